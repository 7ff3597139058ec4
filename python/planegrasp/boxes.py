"""Where the six sides of a box are: their sizes and poses in the box's frame.

The origin is the box's centre; x points to its right, y up and z out of its front side. Sides are
upright as the box unfolds from its front: left, right and back have y up; the lower edge of "top"
and the upper edge of "bottom" touch the front.
"""

from __future__ import annotations

import math

from planegrasp.checks import check_length
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation

SIDES = ("front", "back", "left", "right", "top", "bottom")


def box_face_size(size: tuple[float, float, float], side: str) -> tuple[float, float]:
    """Width and height [m] of one side of a box of (width, height, depth)."""
    width, height, depth = _check_box(size, side)
    if side in ("front", "back"):
        return width, height
    return (depth, height) if side in ("left", "right") else (width, depth)


def box_face_pose(size: tuple[float, float, float], side: str) -> RigidTransform:
    """T_object_face of one side of a box of (width, height, depth), see above."""
    width, height, depth = _check_box(size, side)
    axis, angle, centre = {
        "front": ("y", 0.0, (0.0, 0.0, depth / 2)),
        "back": ("y", math.pi, (0.0, 0.0, -depth / 2)),
        "left": ("y", -math.pi / 2, (-width / 2, 0.0, 0.0)),
        "right": ("y", math.pi / 2, (width / 2, 0.0, 0.0)),
        "top": ("x", -math.pi / 2, (0.0, height / 2, 0.0)),
        "bottom": ("x", math.pi / 2, (0.0, -height / 2, 0.0)),
    }[side]
    return RigidTransform.from_components(centre, Rotation.from_euler(axis, angle))


def _check_box(size: tuple[float, float, float], side: str) -> tuple[float, float, float]:
    if side not in SIDES:
        raise InvalidInputError(f"a box has no side {side!r}; its sides are {', '.join(SIDES)}")
    if len(size) != 3:
        raise InvalidInputError(f"a box's size is (width, height, depth) in metres, got {size}")
    width, height, depth = (check_length(value, "size of a box") for value in size)
    return width, height, depth
