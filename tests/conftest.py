"""Fixtures that several tests share."""

from __future__ import annotations

import os
from functools import cache
from typing import TYPE_CHECKING

import cv2
import hypothesis
import pytest

from planegrasp.bench.textures import texture
from planegrasp.objects import ObjectModel

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

# The machine's speed decides nothing; on CI the same commit gives the same verdict.
hypothesis.settings.register_profile("here", deadline=None, derandomize="CI" in os.environ)
hypothesis.settings.load_profile("here")


@cache
def _photo(name: str, width: int | None) -> NDArray[np.uint8]:
    image = texture(name)
    if width is not None:
        height = round(width * image.shape[0] / image.shape[1])
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    image.flags.writeable = False
    return image


@pytest.fixture(scope="session")
def photo() -> Callable[..., NDArray[np.uint8]]:
    """A photograph by name, H×W×3 RGB: `photo("coffee")`, `photo("coffee", width=200)`."""

    def load(name: str, width: int | None = None) -> NDArray[np.uint8]:
        return _photo(name, width)

    return load


@pytest.fixture
def book(photo: Callable[..., NDArray[np.uint8]]) -> ObjectModel:
    """A small one-face object."""
    return ObjectModel.from_image("book", photo("coffee", width=160), width=0.21)


@pytest.fixture
def carton(photo: Callable[..., NDArray[np.uint8]]) -> ObjectModel:
    """A box with two taught sides."""
    faces = {"front": photo("coffee", width=150), "top": photo("chelsea", width=150)}
    return ObjectModel.box("carton", (0.15, 0.1, 0.1), faces, priority=3)
