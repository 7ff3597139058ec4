"""Fingers that are not seen, against a body whose edges are known."""

import numpy as np
import pytest

from planegrasp.body import BoxBody
from planegrasp.grasping.hidden_fingers import hidden_fingers

BODY = BoxBody((0.16, 0.21, 0.04), (0.01, 0.0, -0.02))


def test_fingers_reach_inwards_over_both_sides():
    """A hand at the left edge, in the middle of its height."""
    left = BODY.centre[0] - BODY.size[0] / 2
    fingers = hidden_fingers(np.array([[left - 0.01, 0.03, -0.02]]), BODY, 0.05)
    assert fingers[:, 0].min() == pytest.approx(left)
    assert fingers[:, 0].max() == pytest.approx(left + 0.05)
    np.testing.assert_allclose(fingers[:, 1], 0.03)
    # The large sides are at z = 0 and -0.04; none is inside.
    heights = np.unique(fingers[:, 2].round(6))
    np.testing.assert_allclose(heights, [-0.06, -0.043, 0.003, 0.02])


def test_what_is_farther_away_holds_nothing():
    points = np.array([[0.3, 0.0, 0.0], [0.0, -0.2, 0.0], [0.0, 0.0, 0.2]])
    assert hidden_fingers(points, BODY, 0.05).shape == (0, 3)
    # In front of the face there is nothing beside an edge.
    assert hidden_fingers(np.array([[0.0, 0.0, 0.02]]), BODY, 0.05).shape == (0, 3)


def test_where_nobody_holds_it_there_are_none():
    assert hidden_fingers(np.array([[-0.08, 0.0, 0.0]]), BODY, 0.0).shape == (0, 3)
    assert hidden_fingers(np.empty((0, 3)), BODY, 0.05).shape == (0, 3)
