"""Smooth lines, areas and arrows on images, at fractions of a pixel."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from planegrasp.viz.palette import RGB

    Image = NDArray[np.uint8]
    Float64Array = NDArray[np.float64]
    Box = tuple[int, int, int, int]  # left, top, width, height [px]

SUBPIXEL_BITS = 4
"""Of the fixed-point numbers that OpenCV draws with."""
FARTHEST_PX = 30_000.0
"""Farther points would overflow OpenCV's coordinates."""


@contextmanager
def blended(image: Image, opacity: float) -> Iterator[Image]:
    """A layer to draw on, laid over the image with this opacity at the end."""
    layer = image.copy()
    yield layer
    cv2.addWeighted(layer, opacity, image, 1 - opacity, 0, dst=image)


def fixed_point(points: Float64Array) -> NDArray[np.int32]:
    """N×2 pixels as the fixed-point numbers that OpenCV draws fractions of a pixel with."""
    near = np.clip(points, -FARTHEST_PX, FARTHEST_PX)
    fixed: NDArray[np.int32] = np.rint(near * 2**SUBPIXEL_BITS).astype(np.int32)
    return fixed


def polygon(image: Image, points: NDArray[np.int32], color: RGB, thickness: float) -> None:
    """The closed line through N×2 fixed points."""
    cv2.polylines(image, [points], True, color, round(thickness), cv2.LINE_AA, SUBPIXEL_BITS)


def line(
    image: Image, points: Float64Array, color: RGB, thickness: float, *, closed: bool = False
) -> None:
    """The line through N×2 pixels."""
    fixed = fixed_point(points)
    cv2.polylines(image, [fixed], closed, color, round(thickness), cv2.LINE_AA, SUBPIXEL_BITS)


def fill(image: Image, points: NDArray[np.int32], color: RGB) -> None:
    """The area between N×2 fixed points."""
    cv2.fillPoly(image, [points], color, cv2.LINE_AA, SUBPIXEL_BITS)


def arrow(
    image: Image, start: Float64Array, end: Float64Array, color: RGB, thickness: float
) -> None:
    """A line with a solid head whose tip is at `end`."""
    along = end - start
    length = float(np.linalg.norm(along))
    if length < 1.0:
        return
    along = along / length
    across = np.array([-along[1], along[0]])
    head = min(4 * thickness, 0.5 * length)
    base = end - head * along
    a, b = fixed_point(np.array([start, base + 0.3 * head * along]))
    cv2.line(image, a.tolist(), b.tolist(), color, round(thickness), cv2.LINE_AA, SUBPIXEL_BITS)
    fill(
        image,
        fixed_point(np.array([end, base + 0.4 * head * across, base - 0.4 * head * across])),
        color,
    )


def rounded(image: Image, box: Box, color: RGB, radius: int) -> None:
    """A filled box with round corners [px]."""
    left, top, width, height = box
    right, bottom = left + width - 1, top + height - 1
    cv2.rectangle(image, (left + radius, top), (right - radius, bottom), color, -1)
    cv2.rectangle(image, (left, top + radius), (right, bottom - radius), color, -1)
    for x in (left + radius, right - radius):
        for y in (top + radius, bottom - radius):
            cv2.circle(image, (x, y), radius, color, -1, cv2.LINE_AA)
