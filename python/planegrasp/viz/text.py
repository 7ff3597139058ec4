"""Text on images, in the typeface that ships inside of OpenCV."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from planegrasp.viz.palette import RGB

REGULAR, SEMIBOLD = 400, 600


def draw_text(
    image: NDArray[np.uint8],
    text: str,
    baseline: tuple[int, int],
    color: RGB,
    *,
    size: int,
    weight: int = REGULAR,
) -> None:
    """Write on an H×W×3 image in place.

    Args:
        image: drawn on.
        text: one line.
        baseline: pixel (x, y) of the left end of the baseline.
        color: RGB.
        size: of the typeface [px].
        weight: 100 (thin) … 1000 (black).
    """
    cv2.putText(image, text, baseline, color, cv2.FontFace("sans"), size, weight)


def text_width(text: str, size: int, weight: int = REGULAR) -> int:
    """Width of one line [px]."""
    _, _, width, _ = cv2.getTextSize((0, 0), text, (0, 0), cv2.FontFace("sans"), size, weight)
    return int(width)
