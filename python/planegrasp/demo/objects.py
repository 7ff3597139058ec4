"""What the demonstration teaches: photographs that ship inside the scikit-image package."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.textures import texture
from planegrasp.objects import ObjectModel

if TYPE_CHECKING:
    from numpy.typing import NDArray

CARTON_SIZE = (0.21, 0.14, 0.10)
"""Width, height and depth of the box [m]."""


def demo_objects() -> tuple[ObjectModel, ...]:
    """Two pictures, and a box whose front, right and top are printed."""
    width, height, depth = CARTON_SIZE
    sides = {
        "front": _cropped(texture("coffee"), width / height),
        "right": _cropped(texture("immunohistochemistry"), depth / height),
        "top": _cropped(texture("rocket"), width / depth),
    }
    return (
        ObjectModel.from_image("astronaut", texture("astronaut"), width=0.22),
        ObjectModel.from_image("cat", texture("chelsea"), width=0.24),
        ObjectModel.box("carton", CARTON_SIZE, sides),
    )


def _cropped(image: NDArray[np.uint8], aspect: float) -> NDArray[np.uint8]:
    """The largest piece of this width over height, from the bottom and the middle."""
    rows, columns = image.shape[:2]
    width, height = min(columns, round(rows * aspect)), min(rows, round(columns / aspect))
    left = (columns - width) // 2
    return np.ascontiguousarray(image[rows - height :, left : left + width])
