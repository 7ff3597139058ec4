"""Conversions between OpenCV's keypoints and `Features`."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from planegrasp.errors import ImageError
from planegrasp.features.base import Features

if TYPE_CHECKING:
    from collections.abc import Sequence

    import cv2
    from cv2.typing import MatLike
    from numpy.typing import NDArray

    Descriptors = NDArray[np.float32] | NDArray[np.uint8]

# No detector finds anything in a smaller image [px], but AKAZE and ORB fail on one row of pixels.
SMALLEST_SIDE = 8


def check_gray(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the image C-contiguous, or raise ImageError if it is not H×W uint8."""
    array = np.asarray(image)
    if array.ndim != 2 or array.dtype != np.uint8 or array.size == 0:
        raise ImageError(
            f"an extractor takes a grey H×W uint8 image, got shape {array.shape}, {array.dtype}"
        )
    return np.ascontiguousarray(array)


def to_features(
    keypoints: Sequence[cv2.KeyPoint],
    descriptors: MatLike | None,
    empty: Descriptors,
) -> Features:
    """`Features` of OpenCV's result; `empty` (0×D) stands for its None when nothing was found."""
    if descriptors is None or not len(keypoints):
        none = np.zeros(0, np.float32)
        return Features(np.zeros((0, 2), np.float32), none, none, none, empty)
    rows = [(*k.pt, k.size, np.radians(k.angle), k.response) for k in keypoints]
    table = np.array(rows, dtype=np.float32)
    points, scales, angles, responses = np.split(table, (2, 3, 4), axis=1)
    described = cast("Descriptors", np.asarray(descriptors, dtype=empty.dtype))
    return Features(points.copy(), scales.ravel(), angles.ravel(), responses.ravel(), described)
