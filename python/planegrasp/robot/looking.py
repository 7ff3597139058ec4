"""Turning a head until a point is in the middle of the camera's image."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import least_squares

from planegrasp.errors import InvalidInputError, RobotError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from planegrasp.geometry import RigidTransform

    Float64Array = NDArray[np.float64]

# A tenth of a pixel at 525 pixels of focal length.
_CENTRED = 2e-4
_STARTS = (0.5, 0.15, 0.85)


def aim(
    T_base_camera: Callable[[Float64Array], RigidTransform],
    ranges: Float64Array,
    start: Float64Array,
    point: Float64Array,
) -> Float64Array:
    """Joint positions of the head that bring a point onto the camera's optical axis.

    Args:
        T_base_camera: pose of the optical frame for k joint positions of the head.
        ranges: limits of these joints, k×2 [rad or m].
        start: where the head is, k; an answer near it is preferred.
        point: 3, base frame [m].

    Raises:
        RobotError: where the head does not reach that direction; it says how far off it stays.
    """
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise InvalidInputError(f"a point to look at is 3 finite coordinates [m], got {point}")
    if not len(start):
        raise RobotError("the robot has no joints that turn a camera: name its camera_frame")
    bounded = np.clip(ranges, -2 * np.pi, 2 * np.pi)
    others = [bounded[:, 0] + share * (bounded[:, 1] - bounded[:, 0]) for share in _STARTS]

    def off_axis(head: Float64Array) -> Float64Array:
        seen = T_base_camera(head).inv().apply(point)
        return np.asarray(seen / np.linalg.norm(seen) - (0.0, 0.0, 1.0))

    best = np.inf
    for first in (start, *others):
        inside = np.clip(first, bounded[:, 0] + 1e-6, bounded[:, 1] - 1e-6)
        solution = least_squares(
            off_axis,
            inside,
            bounds=(bounded[:, 0], bounded[:, 1]),
            xtol=1e-12,
            ftol=1e-14,
            gtol=1e-12,
        )
        off = 2 * math.asin(min(float(np.linalg.norm(solution.fun)) / 2, 1.0))
        if off < _CENTRED:
            return np.asarray(solution.x, dtype=np.float64)
        best = min(best, off)
    raise RobotError(
        f"the head cannot look at ({', '.join(f'{x:.2f}' for x in point)}) m: it stays "
        f"{np.degrees(best):.0f}° off"
    )
