"""What a camera sees of textured rectangles, painted from far to near."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.simulation.rectangle import Rectangle, level_of_detail, polygon_area, sample

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """What the pixels show, without noise; painted in place.

    Attributes:
        image: H×W×3 float32 RGB, 0 … 255.
        depth: H×W float64 [m].
        owner: H×W int32, index of the rectangle that is seen at the pixel's centre, -1 where none.
    """

    image: NDArray[np.float32]
    depth: NDArray[np.float64]
    owner: NDArray[np.int32]

    @classmethod
    def blank(
        cls, camera: PinholeCamera, background: NDArray[np.uint8] | None, background_depth: float
    ) -> Canvas:
        """A background at one depth, stretched over the image; mid grey where None."""
        shape = (camera.height, camera.width)
        if background is None:
            image = np.full((*shape, 3), 128.0, np.float32)
        else:
            image = cv2.resize(background, shape[::-1], interpolation=cv2.INTER_AREA).astype(
                np.float32
            )
        depth = np.full(shape, background_depth, np.float64)
        return cls(image, depth, np.full(shape, -1, np.int32))


def far_to_near(rectangles: Sequence[Rectangle]) -> list[int]:
    """Those that face the camera, each before the ones that can hide it.

    The distance of the centres would not do: an oblique board that hides a face may have its
    centre farther away than the face has.
    """
    facing = [i for i, r in enumerate(rectangles) if r.faces_camera]
    hides = _hides([rectangles[i] for i in facing])
    z = [float(rectangles[i].T_camera_rectangle.translation[2]) for i in facing]
    remaining = sorted(range(len(facing)), key=lambda k: -z[k])
    order: list[int] = []
    while remaining:
        hides_none = (k for k in remaining if not hides[k, remaining].any())
        # Three boards each leaning on the next hide each other in a circle.
        chosen = next(hides_none, remaining[0])
        order.append(facing[chosen])
        remaining.remove(chosen)
    return order


def _hides(rectangles: Sequence[Rectangle]) -> NDArray[np.bool_]:
    """N×N: whether i can hide j but not the other way round; all face the camera."""
    n = len(rectangles)
    above, below = np.zeros((n, n), bool), np.zeros((n, n), bool)
    corners = np.array([r.corners for r in rectangles]).reshape(n, 4, 3)
    for j, rectangle in enumerate(rectangles):
        translation, rotation = rectangle.T_camera_rectangle.as_components()
        # Distances of all corners from this plane [m], positive on its textured side.
        heights = (corners - translation) @ rotation.as_matrix()[:, 2]
        above[:, j] = np.any(heights > 1e-9, axis=1)
        below[:, j] = np.any(heights < -1e-9, axis=1)
    can_hide = above & below.T
    return can_hide & ~can_hide.T


def window(outline: NDArray[np.float64], camera: PinholeCamera) -> tuple[int, int, int, int] | None:
    """The pixels that an outline (N×2) may touch: x from, y from, x to, y to; None outside."""
    low = np.floor(outline.min(axis=0)).astype(int) - 1
    high = np.ceil(outline.max(axis=0)).astype(int) + 2
    x0, y0 = (int(v) for v in np.maximum(low, 0))
    x1, y1 = (int(v) for v in np.minimum(high, (camera.width, camera.height)))
    return None if x0 >= x1 or y0 >= y1 else (x0, y0, x1, y1)


def paint_color(rectangle: Rectangle, camera: PinholeCamera, image: NDArray[np.float32]) -> None:
    """Paint the colour of one rectangle over what lies behind it."""
    corners = camera.project(rectangle.corners)
    roi = window(corners, camera)
    if roi is None:
        return
    texture, samples = level_of_detail(rectangle, corners)
    color, coverage = sample(rectangle, texture, camera, roi, samples)
    region = np.s_[roi[1] : roi[3], roi[0] : roi[2]]
    image[region] = color + (1.0 - coverage[..., None]) * image[region]


def paint_depth(rectangle: Rectangle, index: int, camera: PinholeCamera, canvas: Canvas) -> int:
    """Enter depth and index of one rectangle; return how many pixels it projects to."""
    corners = camera.project(rectangle.corners)
    pixels = round(polygon_area(corners))
    roi = window(corners, camera)
    if roi is None:
        return pixels
    u, v = np.meshgrid(np.arange(roi[0], roi[2]), np.arange(roi[1], roi[3]))
    rays = camera.rays(np.column_stack([u.ravel(), v.ravel()]))
    translation, rotation = rectangle.T_camera_rectangle.as_components()
    R = rotation.as_matrix()
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (R[:, 2] @ translation) / (rays @ R[:, 2])
    on_plane = (rays * z[:, None] - translation) @ R
    hit = (
        (z > 0)
        & (np.abs(on_plane[:, 0]) <= rectangle.width / 2)
        & (np.abs(on_plane[:, 1]) <= rectangle.height / 2)
    ).reshape(u.shape)
    region = np.s_[roi[1] : roi[3], roi[0] : roi[2]]
    canvas.depth[region] = np.where(hit, z.reshape(u.shape), canvas.depth[region])
    canvas.owner[region] = np.where(hit, index, canvas.owner[region])
    return pixels
