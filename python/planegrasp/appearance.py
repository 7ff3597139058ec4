"""Does the face, where the homography puts it, look like its reference?"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from cv2.typing import MatLike
    from numpy.typing import NDArray

# Side of the compared image [px] and number of cells along it.
_SIDE = 96
_CELLS = 6
# Cells of the reference with less contrast [grey levels] than this say nothing.
_MIN_CONTRAST = 6.0
# Correlation above which a cell counts as seen.
_SEEN = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """A reference image prepared for comparison.

    Attributes:
        image: side×side float32, the whole reference squeezed into a square.
        size: width and height of the reference image [px].
    """

    image: NDArray[np.float32]
    size: tuple[int, int]


def prepare_appearance(gray: NDArray[np.uint8]) -> Appearance:
    """Prepare an h×w uint8 reference."""
    small = cv2.resize(gray, (_SIDE, _SIDE), interpolation=cv2.INTER_AREA)
    return Appearance(small.astype(np.float32), (gray.shape[1], gray.shape[0]))


def agreement(
    reference: Appearance, frame_gray: NDArray[np.uint8], homography: NDArray[np.float64]
) -> float:
    """Share of the reference's textured cells that the frame shows, 0 … 1.

    Cells are compared by normalised cross-correlation, so lighting does not matter; a cell that is
    hidden or outside of the image counts as not seen.

    Args:
        reference: prepared reference.
        frame_gray: H×W uint8 undistorted frame.
        homography: reference edge coordinates to undistorted pixels.
    """
    width, height = reference.size
    # Both grids have pixel centres at integers; reference edge coordinates are half a pixel off.
    edge_from_small = np.array(
        [
            [width / _SIDE, 0.0, 0.5 * width / _SIDE],
            [0.0, height / _SIDE, 0.5 * height / _SIDE],
            [0.0, 0.0, 1.0],
        ]
    )
    frame_from_small = homography @ edge_from_small
    seen = cv2.warpPerspective(
        frame_gray,
        frame_from_small,
        (_SIDE, _SIDE),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_CONSTANT,
    )
    # An oblique or distant view has lost detail; compare what both can show.
    a, b = (_cells(cv2.GaussianBlur(i, (0, 0), 1.5)) for i in (reference.image, seen))
    a = a - a.mean(axis=1, keepdims=True)
    b = b - b.mean(axis=1, keepdims=True)
    textured = a.std(axis=1) >= _MIN_CONTRAST
    if not textured.any():
        return 0.0
    norm = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    correlation = (a * b).sum(axis=1) / np.maximum(norm, 1e-6)
    return float(np.mean(correlation[textured] >= _SEEN))


def _cells(image: MatLike) -> NDArray[np.float32]:
    """cells² × pixels of a cell."""
    n = _SIDE // _CELLS
    blocks = image.astype(np.float32).reshape(_CELLS, n, _CELLS, n).transpose(0, 2, 1, 3)
    return blocks.reshape(_CELLS * _CELLS, n * n)
