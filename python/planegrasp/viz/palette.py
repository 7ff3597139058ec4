"""Colours (RGB, 0 … 255) of objects and axes."""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

RGB = tuple[int, int, int]

AXIS_COLORS: tuple[RGB, RGB, RGB] = ((235, 64, 60), (70, 190, 70), (50, 110, 245))
"""x red, y green, z blue."""

INK: RGB = (24, 26, 32)
PAPER: RGB = (255, 255, 255)

# Bright enough to stand out from photographs, apart from one another for most colour-blind
# readers, and none of them one of the axis colours.
_OBJECT_COLORS: tuple[RGB, ...] = (
    (255, 176, 0),
    (0, 190, 214),
    (230, 85, 175),
    (160, 210, 40),
    (150, 110, 255),
    (255, 120, 40),
    (60, 210, 160),
    (215, 180, 120),
)


def object_colors(names: Iterable[str]) -> dict[str, RGB]:
    """A colour for each object; they repeat after eight."""
    return {
        name: _OBJECT_COLORS[i % len(_OBJECT_COLORS)] for i, name in enumerate(dict.fromkeys(names))
    }


def color_of(name: str, colors: Mapping[str, RGB] | None = None) -> RGB:
    """The object's colour: the given one, or else one that is the same in every frame and run."""
    if colors is not None and name in colors:
        return colors[name]
    return _OBJECT_COLORS[zlib.crc32(name.encode()) % len(_OBJECT_COLORS)]


def readable_on(background: RGB) -> RGB:
    """Black or white, whichever can be read better on this colour."""
    r, g, b = background
    return INK if 0.299 * r + 0.587 * g + 0.114 * b > 140 else PAPER
