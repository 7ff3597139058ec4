"""Images side by side with captions, for a report or a README."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.rgbd import check_color
from planegrasp.viz.palette import INK, PAPER
from planegrasp.viz.text import draw_text, text_width

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_CAPTION_SIZE = 17  # [px]


def filmstrip(
    images: Sequence[NDArray[np.uint8]],
    captions: Sequence[str] = (),
    *,
    columns: int | None = None,
    cell_width: int = 480,
    gap: int = 12,
) -> NDArray[np.uint8]:
    """Lay images out in a grid on white, each shrunk or enlarged to one width.

    Args:
        images: H×W×3 uint8 RGB each, of any sizes; a row is as high as its highest image.
        captions: one line below each image, or none at all; cut with … where too long.
        columns: of the grid, by default about as many as rows.
        cell_width: of every image [px].
        gap: around and between the images [px].

    Returns:
        H×W×3 uint8 RGB.

    Raises:
        InvalidInputError: no images, another number of captions, or sizes that are not positive.
        ImageError: an image is not H×W×3 uint8.
    """
    if not images:
        raise InvalidInputError("a filmstrip needs at least one image")
    if captions and len(captions) != len(images):
        raise InvalidInputError(f"got {len(images)} images but {len(captions)} captions")
    columns = columns or math.ceil(math.sqrt(len(images)))
    if columns < 1 or cell_width < 1 or gap < 0:
        raise InvalidInputError(
            f"columns and cell_width must be positive, gap not negative, "
            f"got {columns}, {cell_width} and {gap}"
        )
    cells = [_scaled(check_color(image), cell_width) for image in images]
    columns = min(columns, len(cells))
    band = round(1.9 * _CAPTION_SIZE) if captions else 0
    rows = [range(i, min(i + columns, len(cells))) for i in range(0, len(cells), columns)]
    heights = [max(len(cells[i]) for i in row) + band for row in rows]
    strip = np.full(
        (sum(heights) + gap * (len(rows) + 1), columns * cell_width + gap * (columns + 1), 3),
        PAPER,
        np.uint8,
    )
    top = gap
    for row, height in zip(rows, heights, strict=True):
        for column, i in enumerate(row):
            left = gap + column * (cell_width + gap)
            strip[top : top + len(cells[i]), left : left + cell_width] = cells[i]
            if captions:
                caption = _shortened(captions[i], cell_width)
                baseline = top + len(cells[i]) + round(1.25 * _CAPTION_SIZE)
                draw_text(strip, caption, (left, baseline), INK, size=_CAPTION_SIZE)
        top += height + gap
    return strip


def _scaled(image: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
    rows, columns = image.shape[:2]
    size = (width, max(1, round(rows * width / columns)))
    method = cv2.INTER_AREA if width < columns else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(image, size, interpolation=method), dtype=np.uint8)


def _shortened(text: str, width: int) -> str:
    if text_width(text, _CAPTION_SIZE) <= width:
        return text
    while text and text_width(text + "…", _CAPTION_SIZE) > width:
        text = text[:-1].rstrip()
    return text + "…"
