"""The pose filter against simulated motion: exact without noise, consistent with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.pose_filter import (
    FilteredPose,
    PoseFilterConfig,
    correct,
    first_pose,
    predict,
)

CONFIG = PoseFilterConfig()
# Of a detection: half a millimetre sideways, two along z; 0.2° and 0.4°.
COVARIANCE = np.diag(np.square([5e-4, 5e-4, 2e-3, 3.5e-3, 3.5e-3, 7e-3]))
START = RigidTransform.from_components([0.6, -0.1, 0.9], Rotation.from_euler("xyz", [0.4, -1, 2]))


def moved(T: RigidTransform, v: np.ndarray, w: np.ndarray, t: float) -> RigidTransform:
    return RigidTransform.from_components(
        T.translation + v * t, Rotation.from_rotvec(w * t) * T.rotation
    )


def error_of(state: FilteredPose, truth: RigidTransform, v, w) -> np.ndarray:
    return np.concatenate(
        [
            truth.translation - state.T_base_object.translation,
            (truth.rotation * state.T_base_object.rotation.inv()).as_rotvec(),
            v - state.linear_velocity,
            w - state.angular_velocity,
        ]
    )


def test_a_constant_velocity_is_learnt_exactly_from_exact_measurements():
    v, w = np.array([0.08, -0.03, 0.05]), np.array([0.1, -0.2, 0.15])
    state = first_pose(0.0, START, COVARIANCE, CONFIG)
    for i in range(1, 61):
        t = i / 30
        state = correct(predict(state, t, CONFIG), moved(START, v, w, t), COVARIANCE, CONFIG)
        assert state is not None
    # What the unknown start left has decayed by then; a filter without velocity would lag by
    # several millimetres.
    later = predict(state, 2.2, CONFIG)
    error = error_of(later, moved(START, v, w, 2.2), v, w)
    assert np.abs(error[:3]).max() < 5e-5
    assert np.abs(error[3:6]).max() < 5e-4
    assert np.abs(error[6:9]).max() < 5e-4
    assert np.abs(error[9:]).max() < 5e-3


def test_its_covariance_tells_its_errors():
    """Normalised errors squared have mean 12, if motion and noise are those assumed."""
    config = replace(CONFIG, tremor=0.0, angular_tremor=0.0, gate=100.0)
    rng = np.random.default_rng(3)
    dt, values = 1 / 30, []
    for _ in range(60):
        v = rng.normal(0, config.linear_speed, 3)
        w = rng.normal(0, config.angular_speed, 3)
        truth, state = START, None
        for i in range(40):
            noise = rng.multivariate_normal(np.zeros(6), COVARIANCE)
            measured = truth * RigidTransform.from_components(
                noise[:3], Rotation.from_rotvec(noise[3:])
            )
            if state is None:
                state = first_pose(0.0, measured, COVARIANCE, config)
            else:
                predicted = predict(state, i * dt, config)
                state = correct(predicted, measured, COVARIANCE, config)
            assert state is not None
            if i == 39:
                break
            for _ in range(10):
                truth = moved(truth, v, w, dt / 10)
                v = v + rng.normal(0, config.linear_acceleration * np.sqrt(dt / 10), 3)
                w = w + rng.normal(0, config.angular_acceleration * np.sqrt(dt / 10), 3)
        error = error_of(state, truth, v, w)
        values.append(error @ np.linalg.solve(state.covariance, error))
    # Chi-squared: 12 ± √(24/60), and a margin for the linearisation of the rotation.
    assert 10.0 < np.mean(values) < 14.0


def test_a_measurement_of_something_else_is_refused():
    state = first_pose(0.0, START, COVARIANCE, CONFIG)
    for i in range(1, 30):
        state = correct(predict(state, i / 30, CONFIG), START, COVARIANCE, CONFIG)
    predicted = predict(state, 1.0, CONFIG)
    flipped = START * RigidTransform.from_rotation(Rotation.from_euler("x", 40, degrees=True))
    assert correct(predicted, flipped, COVARIANCE, CONFIG) is None
    assert correct(predicted, START, COVARIANCE, CONFIG) is not None


def test_the_covariance_is_one_of_the_object_s_axes():
    """Uncertain along the object's z alone: so it is along that axis in the base."""
    covariance = np.diag([0.0, 0.0, 4e-6, 0.0, 0.0, 0.0])
    state = first_pose(0.0, START, covariance, replace(CONFIG, tremor=0.0, angular_tremor=0.0))
    z = START.rotation.as_matrix()[:, 2]
    np.testing.assert_allclose(state.covariance[:3, :3], 4e-6 * np.outer(z, z), atol=1e-18)


def test_time_only_goes_forward():
    state = first_pose(2.0, START, COVARIANCE, CONFIG)
    with pytest.raises(InvalidInputError, match=r"at 2\.0 s, got 1\.5 s"):
        predict(state, 1.5, CONFIG)


@pytest.mark.parametrize("name", ["linear_acceleration", "tremor", "gate"])
def test_negative_settings_are_refused(name):
    with pytest.raises(InvalidInputError, match=f"{name} of the pose filter"):
        PoseFilterConfig(**{name: -1.0})


def test_a_covariance_of_another_shape_is_refused():
    with pytest.raises(InvalidInputError, match="finite 6×6"):
        first_pose(0.0, START, np.eye(3), CONFIG)
