"""What is drawn, and where."""

from __future__ import annotations

import numpy as np
import pytest

from planegrasp.viz import draw_detections, object_colors
from planegrasp.viz.geometry import axis_ends
from planegrasp.viz.overlay import label_lines, place_label
from planegrasp.viz.palette import AXIS_COLORS, color_of


def at(image, point):
    x, y = np.rint(point).astype(int)
    return image[y, x].astype(int)


def test_axes_have_their_colours_along_their_whole_length(detection, frame):
    found = detection()
    image = draw_detections(frame, [found])
    origin, *tips = axis_ends(found, frame.camera, 0.07)
    for tip, color in zip(tips, AXIS_COLORS, strict=True):
        for share in (0.5, 0.9):
            drawn = at(image, origin + share * (tip - origin))
            np.testing.assert_allclose(drawn, color, atol=40)
        beyond = at(image, origin + 1.2 * (tip - origin))
        assert np.abs(beyond - color).max() > 60


def test_outline_has_the_objects_colour(detection, frame):
    found = detection()
    image = draw_detections(frame, [found], {"book": (10, 200, 220)})
    corners = found.corners
    for a, b in zip(corners, np.roll(corners, -1, 0), strict=True):
        near_corner = a + 0.04 * (b - a)
        np.testing.assert_allclose(at(image, near_corner), (10, 200, 220), atol=60)
    far_away = [3, frame.color.shape[0] - 3]
    np.testing.assert_array_equal(at(image, far_away), 90)


def test_the_frame_stays_as_it_was(detection, frame):
    before = frame.color.copy()
    image = draw_detections(frame, [detection()])
    assert image.dtype == np.uint8
    assert image.shape == before.shape
    np.testing.assert_array_equal(frame.color, before)
    np.testing.assert_array_equal(draw_detections(frame, []), before)


def test_a_detection_without_a_pose_has_outline_and_label_only(detection, frame):
    found = detection(with_pose=False)
    image = draw_detections(frame, [found])
    center = found.corners.mean(axis=0)
    blue = AXIS_COLORS[2]
    assert np.abs(at(image, center) - blue).max() > 60
    assert label_lines(found) == ("book", "no pose · 40 inliers")


def test_label_lines(detection):
    assert label_lines(detection()) == ("book", "0.701 m · 40 inliers")
    assert label_lines(detection(instance=1))[0] == "book #2"


@pytest.mark.parametrize("x", [-0.4, 0.0, 0.4])
@pytest.mark.parametrize("y", [-0.3, 0.0, 0.3])
def test_labels_stay_inside(detection, frame, x, y):
    found = detection(translation=(x, y, 0.7))
    left, top, width, height = place_label(found.corners, (90, 40), frame.color, 8, [])
    rows, columns = frame.color.shape[:2]
    assert left >= 0
    assert top >= 0
    assert left + width <= columns
    assert top + height <= rows
    draw_detections(frame, [found])


def test_labels_avoid_one_another(detection, frame):
    corners = detection().corners
    first = place_label(corners, (90, 40), frame.color, 8, [])
    second = place_label(corners, (90, 40), frame.color, 8, [first])
    apart_x = abs(first[0] - second[0]) >= 90
    apart_y = abs(first[1] - second[1]) >= 40
    assert apart_x or apart_y


def test_labels_leave_other_objects_free(detection, frame):
    low = detection("low", translation=(0, 0.09, 0.8), degrees=(0, 0, 0))
    high = detection("high", translation=(0, -0.06, 0.8), degrees=(0, 0, 0))
    colors = {"low": (0, 255, 0), "high": (255, 0, 0)}
    (left, top), _, (right, bottom), _ = np.rint(high.corners).astype(int)

    def green_on_high(detections):
        inside = draw_detections(frame, detections, colors)[top:bottom, left:right].astype(int)
        return int(((inside[..., 1] > 200) & (inside[..., 0] < 100)).sum())

    assert green_on_high([low]) > 500, "alone its label would lie there"
    assert green_on_high([low, high]) < 50


def test_an_object_that_fills_the_view_can_be_drawn(detection, frame):
    draw_detections(frame, [detection(translation=(0, 0, 0.09), degrees=(0, 0, 0))])


def test_colours_are_stable_and_differ():
    colors = object_colors(["a", "b", "c", "a"])
    assert len(colors) == len(set(colors.values())) == 3
    assert color_of("b", colors) == colors["b"]
    assert color_of("stranger", colors) == color_of("stranger")
