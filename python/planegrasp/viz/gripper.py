"""A parallel gripper drawn on an image: where it is to go."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.viz.drawing import blended, line
from planegrasp.viz.palette import INK

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera, RigidTransform
    from planegrasp.viz.palette import RGB

    Float64Array = NDArray[np.float64]

_SHADE = 0.45
# Nothing nearer to the camera is drawn [m].
_NEAR = 0.05


def gripper_lines(opening: float, reach: float = 0.11, shaft: float = 0.06) -> list[Float64Array]:
    """A gripper as lines in its frame: its two fingers with the palm, and the wrist behind it.

    Args:
        opening: between the fingertips [m].
        reach: from the palm to the fingertips [m].
        shaft: length of the wrist behind the palm [m].

    Returns:
        N×3 points each [m]; the fingertips are 2 cm before the frame's origin.
    """
    half, tip = opening / 2, 0.02
    back = tip - reach
    fingers = [[tip, half, 0], [back, half, 0], [back, -half, 0], [tip, -half, 0]]
    return [np.array(fingers, dtype=np.float64), np.array([[back, 0, 0], [back - shaft, 0, 0]])]


def draw_gripper(
    image: NDArray[np.uint8],
    camera: PinholeCamera,
    T_camera_gripper: RigidTransform,
    opening: float,
    color: RGB,
) -> None:
    """Draw where a gripper is to go, on an H×W×3 RGB image in place.

    Args:
        image: of the camera.
        camera: its intrinsics.
        T_camera_gripper: x out of the palm, the fingers close along y.
        opening: between the fingertips [m].
        color: RGB.
    """
    unit = max(1.0, math.hypot(*image.shape[:2]) / 800)
    shown = []
    for points in gripper_lines(opening):
        seen = np.atleast_2d(T_camera_gripper.apply(points))
        if seen[:, 2].min() > _NEAR:
            shown.append(camera.project(seen))
    with blended(image, _SHADE) as layer:
        for points in shown:
            line(layer, points, INK, 7 * unit)
    for points in shown:
        line(image, points, color, 4 * unit)
