"""The things that are grasped in experiments, as the paper has them: a carton and a book."""

from __future__ import annotations

from dataclasses import dataclass

from planegrasp.bench.textures import cropped, texture
from planegrasp.boxes import box_face_size
from planegrasp.objects import ObjectModel

CRACKER_BOX_SIZE = (0.158, 0.210, 0.060)
"""Width, height and depth [m]."""
PICTURE_BOOK_SIZE = (0.21, 0.28, 0.02)
"""Width, height and thickness [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """An object with what a simulation has to know besides.

    Attributes:
        model: with faces and body.
        mass: [kg].
    """

    model: ObjectModel
    mass: float


def cracker_box() -> Thing:
    """A carton with different photographs on its four upright sides.

    Raises:
        MissingExtraError: scikit-image, which has the photographs, is not installed.
    """
    sides = {
        "front": "coffee",
        "back": "chelsea",
        "left": "immunohistochemistry",
        "right": "rocket",
    }
    return Thing(_box("cracker-box", CRACKER_BOX_SIZE, sides), mass=0.4)


def picture_book() -> Thing:
    """A book with different photographs on its front and its back, see `cracker_box`."""
    sides = {"front": "astronaut", "back": "retina"}
    return Thing(_box("picture-book", PICTURE_BOOK_SIZE, sides), mass=0.45)


def _box(name: str, size: tuple[float, float, float], sides: dict[str, str]) -> ObjectModel:
    images = {}
    for side, photograph in sides.items():
        width, height = box_face_size(size, side)
        images[side] = cropped(texture(photograph), width / height)
    return ObjectModel.box(name, size, images)
