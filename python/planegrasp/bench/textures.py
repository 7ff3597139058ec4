"""Photographs that ship inside the scikit-image package, as objects and as backgrounds."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import MissingExtraError
from planegrasp.io.images import read_color

if TYPE_CHECKING:
    from numpy.typing import NDArray

_FILES = {
    "astronaut": "astronaut.png",
    "coffee": "coffee.png",
    "chelsea": "chelsea.png",
    "immunohistochemistry": "ihc.png",
    "rocket": "rocket.jpg",
    "retina": "retina.jpg",
    "camera": "camera.png",
    "coins": "coins.png",
    "motorcycle": "motorcycle_left.png",
    "text": "text.png",
}

WELL_TEXTURED = ("astronaut", "coffee", "chelsea", "immunohistochemistry")
WEAK = ("rocket", "retina")
OBJECTS = (*WELL_TEXTURED, *WEAK)
# Where more objects are wanted. Some are backgrounds elsewhere; `scenery` has none of them.
FURTHER = ("motorcycle", "coins", "camera", "text")

_BACKGROUNDS = (
    "hubble_deep_field.jpg",
    "gravel.png",
    "grass.png",
    "moon.png",
    "brick.png",
    "motorcycle_left.png",
    "motorcycle_right.png",
    "coins.png",
    "text.png",
    "camera.png",
)
# The first of them are no things but surroundings.
_SCENERY = 5


def texture(name: str) -> NDArray[np.uint8]:
    """One of the photographs in `OBJECTS` or `FURTHER`, H×W×3 uint8 RGB."""
    return read_color(_folder() / _FILES[name])


def cropped(image: NDArray[np.uint8], aspect: float) -> NDArray[np.uint8]:
    """The largest piece of this width over height, from the bottom and the middle."""
    rows, columns = image.shape[:2]
    width, height = min(columns, round(rows * aspect)), min(rows, round(columns / aspect))
    left = (columns - width) // 2
    return np.ascontiguousarray(image[rows - height :, left : left + width])


@cache
def backgrounds() -> tuple[NDArray[np.uint8], ...]:
    """Photographs and printed pages that are never used as objects."""
    return tuple(read_color(_folder() / name) for name in _BACKGROUNDS)


def scenery() -> tuple[NDArray[np.uint8], ...]:
    """The backgrounds that show no things: sky, gravel, grass, moon and bricks."""
    return backgrounds()[:_SCENERY]


def background(name: str) -> NDArray[np.uint8]:
    """One of the backgrounds by its file's name without the suffix, H×W×3 uint8 RGB."""
    file = next(file for file in _BACKGROUNDS if Path(file).stem == name)
    return read_color(_folder() / file)


def random_background(rng: np.random.Generator) -> NDArray[np.uint8]:
    """A random crop, mirrored at random, of one of the backgrounds."""
    images = backgrounds()
    return random_crop(images[int(rng.integers(len(images)))], rng)


def random_crop(image: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """A part of at least half of each side, mirrored at random."""
    height, width = image.shape[:2]
    share = rng.uniform(0.5, 1.0)
    h, w = round(height * share), round(width * share)
    y, x = rng.integers(height - h + 1), rng.integers(width - w + 1)
    crop = image[y : y + h, x : x + w]
    return crop[:, ::-1] if rng.random() < 0.5 else crop


def _folder() -> Path:
    try:
        import skimage
    except ImportError as error:
        raise MissingExtraError("the demo and the benchmarks", "bench") from error
    return Path(skimage.__file__).parent / "data"
