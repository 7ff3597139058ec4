"""Whether a gripper at a grasp has the object between its fingers, and not in its hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import GraspError, InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.body import BoxBody
    from planegrasp.grasping.canonical import CanonicalGrasp

    Points = NDArray[np.float64]

__all__ = ["GripperShape", "check_against_body", "extent_between_fingers"]

# The six sides of `BoxBody.corners`, each going around.
_SIDES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))


@dataclass(frozen=True, slots=True)
class GripperShape:
    """What of a parallel gripper counts when a grasp is taught, in its own frame [m].

    The frame lies between the fingertips, x out of the palm, fingers close along y. The defaults
    are about those of a PR2.

    Attributes:
        palm_back: x of the palm's back.
        palm_front: x of the palm's front.
        palm_half_width: along y.
        palm_half_height: along z.
        finger_back: x where the fingertips' pads begin.
        finger_front: x where the fingertips end.
        finger_half_height: along z.
        tolerance: how far a fingertip may seem to be inside of the object: poses are measured.

    Raises:
        InvalidInputError: a half size or the tolerance is negative, or a front is behind its back.
    """

    palm_back: float = -0.18
    palm_front: float = -0.06
    palm_half_width: float = 0.06
    palm_half_height: float = 0.035
    finger_back: float = -0.025
    finger_front: float = 0.015
    finger_half_height: float = 0.010
    tolerance: float = 0.002

    def __post_init__(self) -> None:
        halves = (self.palm_half_width, self.palm_half_height, self.finger_half_height)
        if not (all(half > 0 for half in halves) and self.tolerance >= 0):
            raise InvalidInputError(
                f"half sizes of a gripper must be > 0 m, its tolerance ≥ 0 m, got {self}"
            )
        if not self.palm_back < self.palm_front <= self.finger_back < self.finger_front:
            raise InvalidInputError(
                f"along x a gripper has palm_back < palm_front ≤ finger_back < finger_front, got "
                f"{self}"
            )


def check_against_body(
    grasp: CanonicalGrasp, body: BoxBody, shape: GripperShape | None = None
) -> None:
    """Refuse a grasp whose gripper is inside of the object, or has nothing between its fingers.

    Args:
        grasp: as taught.
        body: of the object, see `ObjectModel.outer_body`.
        shape: of the gripper; None is `GripperShape()`.

    Raises:
        GraspError: the object is not between the fingertips (how far away it is), wider than the
            opening, where a fingertip is, or where the palm is.
    """
    shape = shape or GripperShape()
    corners = _corners(grasp, body)
    half = grasp.opening / 2
    low, high = _between_fingers(corners, shape)
    if low > half or high < -half:
        raise GraspError(
            f"grasp {grasp.name!r} has nothing between the fingertips: the object is "
            f"{1000 * _distance(grasp, body):.1f} mm away from the point between them"
        )
    if high - low > grasp.opening + 2 * shape.tolerance:
        raise GraspError(
            f"grasp {grasp.name!r} is too narrow: the object is {1000 * (high - low):.1f} mm wide "
            f"between the fingertips, they are {1000 * grasp.opening:.1f} mm apart"
        )
    for side, excess in (("left (+y)", high - half), ("right (-y)", -half - low)):
        if excess > shape.tolerance:
            raise GraspError(
                f"grasp {grasp.name!r} has the {side} fingertip {1000 * excess:.1f} mm inside of "
                f"the object: move the gripper by that along y, or open it further than "
                f"{1000 * grasp.opening:.1f} mm"
            )
    _check_palm(grasp, body, corners, shape)


def extent_between_fingers(
    grasp: CanonicalGrasp, body: BoxBody, shape: GripperShape | None = None
) -> tuple[float, float]:
    """Lowest and highest y [m], in the gripper's frame, of the object where the fingers close.

    (∞, -∞) where there is nothing of it.
    """
    return _between_fingers(_corners(grasp, body), shape or GripperShape())


def _corners(grasp: CanonicalGrasp, body: BoxBody) -> Points:
    """8×3 corners of the object in the gripper's frame."""
    return np.asarray(grasp.T_object_gripper.inv().apply(body.corners), dtype=np.float64)


def _between_fingers(corners: Points, shape: GripperShape) -> tuple[float, float]:
    """The fingers sweep along y; the object's surface in there has its lowest and highest y."""
    along_x = (shape.finger_back, shape.finger_front)
    along_z = (-shape.finger_half_height, shape.finger_half_height)
    inside = _clipped(corners, (along_x, (-np.inf, np.inf), along_z))
    y = [side[:, 1] for side in inside]
    return (float(min(map(min, y))), float(max(map(max, y)))) if inside else (np.inf, -np.inf)


def _check_palm(grasp: CanonicalGrasp, body: BoxBody, corners: Points, shape: GripperShape) -> None:
    palm = (
        (shape.palm_back, shape.palm_front),
        (-shape.palm_half_width, shape.palm_half_width),
        (-shape.palm_half_height, shape.palm_half_height),
    )
    cut = _clipped(corners, palm)
    if cut:
        deepest = min(float(side[:, 0].min()) for side in cut)
    elif _outside(grasp, body, np.array([(low + high) / 2 for low, high in palm])) == 0.0:
        deepest = shape.palm_back
    else:
        return
    depth = shape.palm_front - deepest
    if depth > shape.tolerance:
        raise GraspError(
            f"grasp {grasp.name!r} has the palm {1000 * depth:.1f} mm inside of the object: the "
            f"gripper reaches through it; move it back, against x of its frame"
        )


def _clipped(corners: Points, limits: tuple[tuple[float, float], ...]) -> list[Points]:
    """What of a box's six sides lies within limits along x, y and z (Sutherland and Hodgman)."""
    sides = []
    for indices in _SIDES:
        polygon = corners[list(indices)]
        for axis, (low, high) in enumerate(limits):
            polygon = _half_space(polygon, polygon[:, axis] - low)
            polygon = _half_space(polygon, high - polygon[:, axis])
        if len(polygon):
            sides.append(polygon)
    return sides


def _half_space(polygon: Points, heights: Points) -> Points:
    """The part of a convex polygon whose corners have heights ≥ 0."""
    if np.all(heights >= 0):
        return polygon
    kept = []
    for i in range(len(polygon)):
        a, b = heights[i - 1], heights[i]
        if (a >= 0) != (b >= 0):
            kept.append(polygon[i - 1] + (polygon[i] - polygon[i - 1]) * a / (a - b))
        if b >= 0:
            kept.append(polygon[i])
    return np.array(kept).reshape(-1, 3)


def _distance(grasp: CanonicalGrasp, body: BoxBody) -> float:
    """From the point between the fingertips to the object [m]."""
    return _outside(grasp, body, np.zeros(3))


def _outside(grasp: CanonicalGrasp, body: BoxBody, point: Points) -> float:
    """Distance of a point in the gripper's frame from the object, 0 inside of it [m]."""
    local = grasp.T_object_gripper.apply(point) - np.asarray(body.centre)
    return float(np.linalg.norm(np.maximum(np.abs(local) - np.asarray(body.size) / 2, 0.0)))
