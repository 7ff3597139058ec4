"""How far an uncertain object is off between the fingers, against Monte Carlo."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.grasping import CanonicalGrasp
from planegrasp.grasping.doubts import closing_sigma, doubt_covariance


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_closing_sigma_is_what_samples_say(seed):
    rng = np.random.default_rng(seed)
    T_object_gripper = RigidTransform.from_components(
        rng.uniform(-0.3, 0.3, 3), Rotation.random(rng=rng)
    )
    grasp = CanonicalGrasp("side", T_object_gripper, 0.08)
    half = rng.normal(size=(6, 6)) * np.array([0.003] * 3 + [0.01] * 3)[:, None]
    covariance = half @ half.T
    samples = rng.multivariate_normal(np.zeros(6), covariance, size=20_000)
    # The object is displaced in its own frame; the gripper is where it was expected to be.
    # What of the object was between the fingers moves along their y by:
    point = T_object_gripper.translation
    moved = Rotation.from_rotvec(samples[:, 3:]).apply(point) + samples[:, :3] - point
    along = moved @ T_object_gripper.rotation.as_matrix()[:, 1]
    # 20 000 samples know a standard deviation to 0.5 %; rotations of 2° are linear to 0.1 %.
    assert closing_sigma(grasp, covariance) == pytest.approx(along.std(), rel=0.03)


def test_correlation_counts():
    # Turning about y while shifting along z: both cancel at a point 0.1 m along x, or add up.
    grasp = CanonicalGrasp(
        "side",
        RigidTransform.from_components(
            [0.1, 0.0, 0.0], Rotation.from_matrix([[-1, 0, 0], [0, 0, 1], [0, 1, 0]])
        ),
        0.08,
    )
    direction = np.array([0.0, 0.0, 0.001, 0.0, 0.01, 0.0])  # w × p = -0.01 · 0.1 along z
    assert closing_sigma(grasp, np.outer(direction, direction)) == pytest.approx(0.0, abs=1e-9)
    direction[4] *= -1
    assert closing_sigma(grasp, np.outer(direction, direction)) == pytest.approx(0.002)


def test_an_exact_pose_is_not_doubted():
    assert doubt_covariance(np.zeros((6, 6)), 0.02, 0.05) == ""


def test_the_worst_direction_counts():
    # 25 mm along a diagonal are only 14 mm along each axis.
    diagonal = np.ones(3) / np.sqrt(3)
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = 0.025**2 * np.outer(diagonal, diagonal)
    assert "uncertain by 25.0 mm" in doubt_covariance(covariance, 0.02, 0.05)
    assert doubt_covariance(covariance, 0.026, 0.05) == ""
