"""The fiducial marker that poses are compared with: its pose must be as good as it can be."""

import math

import numpy as np
import pytest

from planegrasp.bench.marker import marker_pose, marker_rectangle
from planegrasp.bench.scenes import CAMERA, random_pose
from planegrasp.geometry import rotation_angle
from planegrasp.simulation import render


def frame_with_marker(T, seed=0, noise=3.0):
    return render(
        [marker_rectangle(0.2, T)], CAMERA, np.random.default_rng(seed), color_noise=noise
    ).frame


@pytest.mark.parametrize("degrees", [15, 30, 45])
def test_marker_pose_recovers_a_known_pose(degrees):
    T = random_pose(np.random.default_rng(degrees), math.radians(degrees))
    found = marker_pose(frame_with_marker(T), 0.2)
    assert found is not None
    # A module off, or a corner half a pixel off, would be 1 % of 0.7 m or about a degree.
    assert np.linalg.norm(found.translation - T.translation) < 0.003
    assert math.degrees(rotation_angle(found.rotation, T.rotation)) < 0.7


def test_the_stated_width_is_that_of_the_black_square():
    T = random_pose(np.random.default_rng(1), 0.3)
    frame = frame_with_marker(T, noise=0.0)
    true, wrong = marker_pose(frame, 0.2), marker_pose(frame, 0.25)
    assert true is not None
    assert wrong is not None
    assert true.translation[2] == pytest.approx(T.translation[2], rel=0.004)
    assert wrong.translation[2] == pytest.approx(1.25 * true.translation[2], rel=1e-6)


def test_no_marker_no_pose():
    frame = render([], CAMERA, np.random.default_rng(0)).frame
    assert marker_pose(frame, 0.2) is None
