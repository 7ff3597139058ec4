"""Where the fingers of a hand may be that holds an object: mostly they are not seen."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.body import BoxBody

    Points = NDArray[np.float64]

__all__ = ["hidden_fingers"]

# Nearer to the object than this a hand holds it [m].
_AT_HAND = 0.03
# Fingers are from so far to so far off the object's sides [m].
_FINGER = (0.003, 0.02)
# Between the points [m].
_SPACING = 0.0125


def hidden_fingers(points: Points, body: BoxBody, reach: float) -> Points:
    """Points where fingers may be of a hand that holds an object by its edges.

    A thumb over the face is as near to it as the noise of depth, and fingers behind the object are
    hidden by it. They are taken to reach straight inwards from where the hand is seen beside the
    object, over both of its large sides.

    Args:
        points: N×3, where things are seen, in the object's frame.
        body: of the object.
        reach: how far fingers reach over an edge [m]; 0 for none.

    Returns:
        M×3 points in the object's frame.
    """
    if reach == 0:
        return np.empty((0, 3))
    centre, half = np.asarray(body.centre), np.asarray(body.size) / 2
    centred = points - centre
    away = np.abs(centred) - half
    hand = np.all(away <= _AT_HAND, axis=1) & np.any(away[:, :2] > 0, axis=1)
    centred, away = centred[hand], away[hand]
    # Across the edge beyond which it lies.
    rows, axis = np.arange(len(centred)), np.argmax(away[:, :2], axis=1)
    inwards = np.zeros_like(centred)
    inwards[rows, axis] = -np.sign(centred[rows, axis])
    edge = np.clip(centred, -half, half)
    ways = np.linspace(0.0, reach, math.ceil(reach / _SPACING) + 1)
    over = np.concatenate([edge + way * inwards for way in ways])[:, :2]
    heights = [side * (half[2] + off) for off in _FINGER for side in (-1.0, 1.0)]
    fingers = [np.column_stack([over, np.full(len(over), z)]) for z in heights]
    return np.asarray(np.concatenate(fingers) + centre, dtype=np.float64)
