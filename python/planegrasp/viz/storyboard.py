"""Pictures as a table: a story a block, its stages in columns, its views in rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.viz.drawing import blended, rounded
from planegrasp.viz.palette import INK, PAPER
from planegrasp.viz.text import SEMIBOLD, draw_text, text_width

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Image = NDArray[np.uint8]

_SIZE = 25  # of titles [px]
_SMALL = 19  # of the views' names [px]
_LABEL = 0.85  # opacity behind the views' names


def storyboard(
    stories: Sequence[tuple[str, Sequence[Sequence[Image]]]],
    columns: Sequence[str],
    views: Sequence[str],
    *,
    cell: tuple[int, int] = (392, 245),
    gap: int = 8,
) -> Image:
    """Lay pictures out with titles above the columns and the blocks, and views' names in the rows.

    Args:
        stories: title and rows of each, a row for each view, a picture for each column; H×W×3
            uint8 RGB.
        columns: names of the stages.
        views: names of the rows.
        cell: width and height of each picture, whose middle is kept where its shape is another
            [px].
        gap: around and between the pictures [px].

    Returns:
        H×W×3 uint8 RGB.

    Raises:
        InvalidInputError: a story has another number of rows, or a row of pictures.
    """
    width, height = cell
    band = round(1.7 * _SIZE)
    board_width = len(columns) * (width + gap) + gap
    block = band + len(views) * (height + gap)
    board = np.full((band + len(stories) * (block + gap), board_width, 3), PAPER, np.uint8)
    for column, name in enumerate(columns):
        middle = gap + column * (width + gap) + width // 2
        left = middle - text_width(name, _SIZE) // 2
        draw_text(board, name, (left, round(1.2 * _SIZE)), INK, size=_SIZE)
    top = band
    for title, rows in stories:
        if len(rows) != len(views) or any(len(row) != len(columns) for row in rows):
            raise InvalidInputError(
                f"{title!r} needs {len(views)} rows of {len(columns)} pictures, got "
                f"{[len(row) for row in rows]}"
            )
        draw_text(board, title, (gap, top + round(1.1 * _SIZE)), INK, size=_SIZE, weight=SEMIBOLD)
        y = top + band
        for view, row in zip(views, rows, strict=True):
            for column, picture in enumerate(row):
                left = gap + column * (width + gap)
                board[y : y + height, left : left + width] = _fitted(picture, cell)
            _label(board, view, (gap + 6, y + 6))
            y += height + gap
        top += block + gap
    return board


def _label(board: Image, text: str, corner: tuple[int, int]) -> None:
    left, top = corner
    box = (left, top, text_width(text, _SMALL) + 14, round(1.6 * _SMALL))
    with blended(board, _LABEL) as layer:
        rounded(layer, box, PAPER, 4)
    draw_text(board, text, (left + 7, top + round(1.15 * _SMALL)), INK, size=_SMALL)


def _fitted(picture: Image, cell: tuple[int, int]) -> Image:
    """The middle of a picture in a cell's shape, at its size."""
    rows, columns = picture.shape[:2]
    width, height = cell
    wide = min(columns, round(rows * width / height))
    high = min(rows, round(columns * height / width))
    left, top = (columns - wide) // 2, (rows - high) // 2
    middle = picture[top : top + high, left : left + wide]
    method = cv2.INTER_AREA if width < wide else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(middle, cell, interpolation=method), dtype=np.uint8)
