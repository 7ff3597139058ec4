"""What the demonstration teaches: photographs that ship inside the scikit-image package."""

from __future__ import annotations

from planegrasp.bench.textures import cropped, texture
from planegrasp.objects import ObjectModel

CARTON_SIZE = (0.21, 0.14, 0.10)
"""Width, height and depth of the box [m]."""


def demo_objects() -> tuple[ObjectModel, ...]:
    """Two pictures, and a box whose front, right and top are printed."""
    width, height, depth = CARTON_SIZE
    sides = {
        "front": cropped(texture("coffee"), width / height),
        "right": cropped(texture("immunohistochemistry"), depth / height),
        "top": cropped(texture("rocket"), width / depth),
    }
    return (
        ObjectModel.from_image("astronaut", texture("astronaut"), width=0.22),
        ObjectModel.from_image("cat", texture("chelsea"), width=0.24),
        ObjectModel.box("carton", CARTON_SIZE, sides),
    )
