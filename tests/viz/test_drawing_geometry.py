"""Outlines, sizes and axes lie where the camera says."""

from __future__ import annotations

import numpy as np
import pytest

from planegrasp.viz.geometry import axis_ends, face_outline, face_size


@pytest.mark.parametrize("degrees", [(0, 0, 0), (20, -25, 10), (0, 60, 0), (-65, 10, 120)])
def test_size_of_a_face_comes_from_homography_and_pose(detection, camera, degrees):
    size = face_size(detection(degrees=degrees), camera)
    assert size == pytest.approx((0.20, 0.14), rel=1e-4)


def test_size_needs_a_pose(detection, camera):
    with pytest.raises(ValueError, match="without a pose"):
        face_size(detection(with_pose=False), camera)


def test_outline_follows_the_lens(detection, camera):
    found = detection(translation=(0.1, 0.06, 0.6))
    outline = face_outline(found.faces[0], camera)
    T = found.T_camera_object
    on_edge = np.column_stack([np.linspace(-0.1, 0.1, 400), np.full(400, 0.07), np.zeros(400)])
    top = camera.project(T.apply(on_edge))
    samples = outline[:17] if camera.is_distorted else outline[:2]
    for point in samples:
        assert np.linalg.norm(top - point, axis=1).min() < 0.2
    assert len(outline) == (64 if camera.is_distorted else 4)


def test_axis_ends(detection, camera):
    found = detection()
    T = found.T_camera_object
    ends = axis_ends(found, camera, 0.05)
    expected = camera.project(T.apply([[0, 0, 0], [0.05, 0, 0], [0, 0.05, 0], [0, 0, 0.05]]))
    np.testing.assert_allclose(ends, expected, atol=1e-9)
    assert axis_ends(detection(with_pose=False), camera, 0.05) is None
    assert axis_ends(found, camera, 5.0) is None, "an axis that ends behind the camera"
