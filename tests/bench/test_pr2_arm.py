"""The closed-form arm: each solution reaches its pose, and each reachable pose is found so."""

from __future__ import annotations

import numpy as np
import pytest

from planegrasp.bench.pr2_arm import ArmLimits, forward, solutions
from planegrasp.geometry import RigidTransform, Rotation, rotation_angle

LIMITS = ArmLimits(
    (-2.2854, -0.5236, -3.90, -2.3213, -np.inf, -2.18, -np.inf),
    (0.7146, 1.3963, 0.80, 0.0, np.inf, 0.0, np.inf),
)
LOWER = np.where(np.isfinite(LIMITS.lower), LIMITS.lower, -np.pi)
UPPER = np.where(np.isfinite(LIMITS.upper), LIMITS.upper, np.pi)


def test_every_solution_reaches_the_pose_and_the_arm_s_own_angles_are_among_them():
    rng = np.random.default_rng(1)
    for _ in range(50):
        q, torso = rng.uniform(LOWER, UPPER), rng.uniform(0, 0.33)
        T = forward(q, torso)
        # Around its own pan, finely: the grid must come near the angles that made the pose.
        near = ArmLimits((q[0] - 1e-9, *LIMITS.lower[1:]), (q[0] + 1e-9, *LIMITS.upper[1:]))
        found = solutions(T, torso, near)
        turns = np.angle(np.exp(1j * (found - q)))
        assert np.abs(turns).max(axis=1).min() < 1e-6
        swept = solutions(T, torso, LIMITS)
        assert len(swept) > 0
        for solution in swept[:: max(1, len(swept) // 10)]:
            reached = forward(solution, torso)
            assert np.abs(reached.translation - T.translation).max() < 1e-9
            assert rotation_angle(reached.rotation, T.rotation) < 1e-7
            assert np.all(solution >= LOWER - 1e-9)
            assert np.all(solution[[0, 1, 2, 3, 5]] <= UPPER[[0, 1, 2, 3, 5]] + 1e-9)


@pytest.mark.parametrize(
    "place",
    [[1.4, -0.2, 0.9], [-0.9, 0.0, 0.9], [0.1, -0.2, 2.2]],
    ids=["too far", "behind", "too high"],
)
def test_nothing_is_found_out_of_reach(place):
    T = RigidTransform.from_components(place, Rotation.identity())
    assert solutions(T, 0.2, LIMITS).shape == (0, 7)
    assert len(solutions(forward(np.array([0, 0.3, -0.5, -1, 0.3, -0.7, 1]), 0.2), 0.2, LIMITS))
