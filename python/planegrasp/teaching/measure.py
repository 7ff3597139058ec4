"""The size of a rectangle, measured from the depth between its four corners."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp import _core
from planegrasp.errors import TeachingError
from planegrasp.teaching.rectify import check_corners, opposite_sides

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.rgbd import RGBDFrame

__all__ = ["measure_size"]

# The outer part of the face is left out: there the sensor mixes it with what lies behind.
_INNER_SHARE = 0.85
_FEWEST_PIXELS = 100
_SMALLEST_DEPTH_SHARE = 0.2
# Scatter of the depth about the plane, and departures from a rectangle, that are still plausible.
_LARGEST_SCATTER_SHARE = 0.05
_LARGEST_SIDE_RATIO = 1.2
_LARGEST_SKEW = np.radians(12.0)


def measure_size(frame: RGBDFrame, corners: ArrayLike) -> tuple[float, float]:
    """Width and height [m] of the flat rectangle between four corners of an RGB-D frame.

    A plane is fitted robustly to the depth inside the corners, the viewing rays of the corners are
    intersected with it, and opposite sides are averaged. Depth at the corners themselves, where
    sensors fail, is not used.

    Args:
        frame: colour with depth.
        corners: 4×2 observed pixels: top-left, top-right, bottom-right, bottom-left.

    Raises:
        TeachingError: the frame has no depth, too little of it lies inside the corners, it is not
            flat, or the corners are not those of a rectangle on the plane.
    """
    if frame.depth is None:
        raise TeachingError(
            f"frame {frame.name!r} has no depth to measure the size from: give the width instead"
        )
    points = check_corners(corners, frame.color.shape[:2])
    rays, inverse_depth = _depth_inside(frame.depth, frame.camera, points)
    fitted = _core.fit_plane(rays, inverse_depth)
    if fitted is None:
        raise TeachingError("the depth inside the corners spans no plane: move closer")
    plane, scatter = np.array(fitted[0]), fitted[1]
    corner_rays = frame.camera.rays(points)
    inverse = corner_rays @ plane
    if inverse.min() <= 0:
        raise TeachingError("the plane through the depth does not meet the corners' viewing rays")
    corners_3d = corner_rays / inverse[:, None]
    sides = opposite_sides(corners_3d)
    _check_flat(scatter, inverse_depth, float(sides.min()))
    _check_rectangle(corners_3d, sides)
    width, height = sides.mean(axis=1)
    return float(width), float(height)


def _depth_inside(
    depth: NDArray[np.float32], camera: PinholeCamera, corners: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rays (N×3, z = 1) and inverse depths [1/m] of the measured pixels well inside the corners."""
    centre = corners.mean(axis=0)
    inner = centre + _INNER_SHARE * (corners - centre)
    mask = np.zeros(depth.shape, np.uint8)
    cv2.fillConvexPoly(mask, np.rint(inner).astype(np.int32), 1)
    inside = mask.astype(bool)
    measured = inside & (depth > 0)
    wanted = max(_FEWEST_PIXELS, _SMALLEST_DEPTH_SHARE * inside.sum())
    if measured.sum() < wanted:
        raise TeachingError(
            f"only {measured.sum()} of {inside.sum()} pixels inside the corners have a depth, at "
            f"least {int(wanted)} are needed: move closer, avoid glare, or give the width instead"
        )
    rows, columns = np.nonzero(measured)
    rays = camera.rays(np.column_stack([columns, rows]))
    return rays, 1.0 / depth[measured].astype(np.float64)


def _check_flat(scatter: float, inverse_depth: NDArray[np.float64], side: float) -> None:
    distance = 1.0 / float(np.median(inverse_depth))
    scatter_z = scatter * distance**2
    if scatter_z > _LARGEST_SCATTER_SHARE * side:
        raise TeachingError(
            f"the depth inside the corners scatters by {1000 * scatter_z:.1f} mm about a plane, "
            f"more than {_LARGEST_SCATTER_SHARE:.0%} of the {1000 * side:.0f} mm side: the face is "
            f"not flat, or too far away ({distance:.2f} m) for this sensor"
        )


def _check_rectangle(corners: NDArray[np.float64], sides: NDArray[np.float64]) -> None:
    for (one, other), (first, second) in zip(
        sides, (("top", "bottom"), ("right", "left")), strict=True
    ):
        if max(one, other) > _LARGEST_SIDE_RATIO * min(one, other):
            raise TeachingError(
                f"the corners are not those of a rectangle: measured on the depth, the {first} "
                f"side is {1000 * one:.0f} mm long and the {second} side {1000 * other:.0f} mm"
            )
    across = corners[1] + corners[2] - corners[0] - corners[3]
    down = corners[3] + corners[2] - corners[0] - corners[1]
    cosine = float(across @ down / (np.linalg.norm(across) * np.linalg.norm(down)))
    skew = float(np.arcsin(np.clip(cosine, -1.0, 1.0)))
    if abs(skew) > _LARGEST_SKEW:
        raise TeachingError(
            f"the corners are not those of a rectangle: measured on the depth, its sides meet at "
            f"{90.0 - np.degrees(skew):.0f}°"
        )
