"""Trajectories against their limits by differences, and against closed forms."""

import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.robot import Path, time_parameterise
from planegrasp.robot.path import densify, round_corners


def bent_path():
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.0], [1.0, 1.0, -0.5], [0.2, 1.2, -0.5]])
    return Path(round_corners(densify(corners, 0.02), 60, lambda _: True))


def test_limits_are_kept_between_the_points_too():
    velocity, acceleration = np.array([1.0, 0.8, 0.5]), np.array([3.0, 4.0, 2.0])
    trajectory = time_parameterise(bent_path(), velocity, acceleration)
    dt = 1e-3
    t = np.arange(0, trajectory.duration + dt, dt)
    q = trajectory.sample(t)
    by_difference = np.diff(q, axis=0) / dt
    np.testing.assert_allclose(by_difference, trajectory.velocity(t[:-1] + dt / 2), atol=2e-3)
    assert np.all(np.abs(by_difference) <= velocity * 1.001)
    bends = np.diff(q, 2, axis=0) / dt**2
    # Limits hold at the points exactly; between them cubic pieces may exceed them slightly.
    assert np.all(np.abs(bends) <= acceleration * 1.15)
    # Somewhere a limit is what decides.
    used = np.max(np.abs(by_difference) / velocity, axis=1)
    assert used.max() > 0.95


def test_it_passes_where_the_path_passes():
    path = bent_path()
    trajectory = time_parameterise(path, 1.0, 3.0)
    np.testing.assert_allclose(trajectory.sample(0.0), path.start)
    np.testing.assert_allclose(trajectory.sample(trajectory.duration), path.end)
    t = np.linspace(0, trajectory.duration, 500)
    apart = [np.abs(path.q - q).max(axis=1).min() for q in trajectory.sample(t)]
    # Half a step of the path.
    assert max(apart) < 0.011


def test_it_rests_at_both_ends_and_beyond():
    trajectory = time_parameterise(bent_path(), 1.0, 3.0)
    end = trajectory.duration
    for t in (-1.0, 0.0, end, end + 1.0):
        np.testing.assert_allclose(trajectory.velocity(t), 0.0, atol=1e-9)
    np.testing.assert_allclose(trajectory.sample(end + 1.0), trajectory.sample(end))
    np.testing.assert_allclose(trajectory.sample(-1.0), trajectory.sample(0.0))


def test_one_joint_moves_in_a_trapezoid():
    """2 rad at 1 rad/s: half of 4 rad/s² is for speeding up, so d/v + v/a = 2 + 0.5 s."""
    path = Path(np.linspace(0, 2, 401)[:, None])
    trajectory = time_parameterise(path, 1.0, 4.0)
    assert trajectory.duration == pytest.approx(2.5, abs=0.01)
    assert trajectory.sample(1.25)[0] == pytest.approx(1.0, abs=1e-3)
    assert trajectory.velocity(1.25)[0] == pytest.approx(1.0, abs=1e-6)
    assert trajectory.velocity(0.25)[0] == pytest.approx(0.5, abs=0.02)


def test_half_the_speed():
    path = Path(np.linspace(0, 2, 401)[:, None])
    fast, slow = (time_parameterise(path, 1.0, 100.0, speed=speed) for speed in (1.0, 0.5))
    assert slow.duration == pytest.approx(2 * fast.duration, rel=0.02)


def test_a_sharp_corner_is_passed_slowly():
    corner = densify(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), 0.02)
    trajectory = time_parameterise(Path(corner), 1.0, 3.0)
    t = np.linspace(0, trajectory.duration, 2000)
    q, speed = trajectory.sample(t), np.linalg.norm(trajectory.velocity(t), axis=1)
    at_corner = np.abs(q - (1.0, 0.0)).max(axis=1) < 0.005
    assert speed[at_corner].max() < 0.4
    assert speed.max() > 0.9


def test_standing_still_takes_no_time():
    trajectory = time_parameterise(Path(np.array([[0.3, 0.4], [0.3, 0.4]])), 1.0, 1.0)
    assert trajectory.duration == 0.0
    assert trajectory.sample(0.5).tolist() == [0.3, 0.4]
    assert trajectory.velocity(0.0).tolist() == [0.0, 0.0]
    assert trajectory.sample([0.0, 1.0]).shape == (2, 2)


def test_bad_limits():
    path = bent_path()
    with pytest.raises(InvalidInputError, match=r"velocity_limits must be > 0.*got 0\.0"):
        time_parameterise(path, 0.0, 1.0)
    with pytest.raises(InvalidInputError, match="acceleration_limits must be > 0, one for all"):
        time_parameterise(path, 1.0, [1.0, 2.0])
    with pytest.raises(InvalidInputError, match=r"speed must be in \(0, 1\], got 1.5"):
        time_parameterise(path, 1.0, 1.0, speed=1.5)


def test_densified_points_are_a_step_apart_at_most():
    points = densify(np.array([[0.0, 0.0], [0.1, -0.05], [0.1, 0.0]]), 0.03)
    assert np.abs(np.diff(points, axis=0)).max() <= 0.03 + 1e-12
    assert [0.1, -0.05] in points.round(12).tolist()
    assert len(points) == 1 + 4 + 2


def test_corners_stay_where_rounding_is_not_free():
    corner = densify(np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.5]]), 0.02)
    assert round_corners(corner, 60, lambda _: False) is corner
    rounded = round_corners(corner, 60, lambda _: True)
    assert np.abs(rounded - (0.5, 0.0)).max(axis=1).min() > 0.01
    assert rounded[0].tolist() == corner[0].tolist()
    assert rounded[-1].tolist() == corner[-1].tolist()
