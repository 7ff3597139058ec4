"""How much room an object takes: the outer box of it, for fingers and collisions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.checks import check_length
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

    from planegrasp.objects import PlanarFace

__all__ = ["FLAT_THICKNESS", "BoxBody", "body_behind"]

# A face of unknown thickness is a thing all the same: a sheet of cardboard [m].
FLAT_THICKNESS = 0.005


@dataclass(frozen=True, slots=True)
class BoxBody:
    """The outer box of an object, with its edges along the axes of the object's frame.

    Attributes:
        size: along x, y and z of the object's frame [m].
        centre: of the box in the object's frame [m].

    Raises:
        InvalidInputError: a size is not positive and finite, or the centre not three finite
            numbers.
    """

    size: tuple[float, float, float]
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if len(self.size) != 3:
            raise InvalidInputError(f"a body's size is three lengths (x, y, z), got {self.size}")
        x, y, z = (check_length(value, "size of a body") for value in self.size)
        centre = np.asarray(self.centre, dtype=np.float64)
        if centre.shape != (3,) or not np.all(np.isfinite(centre)):
            raise InvalidInputError(
                f"a body's centre is three finite numbers (x, y, z), got {self.centre}"
            )
        object.__setattr__(self, "size", (x, y, z))
        object.__setattr__(self, "centre", tuple(centre.tolist()))

    @classmethod
    def around(cls, points: ArrayLike) -> BoxBody:
        """The smallest box around points (N×3, object's frame)."""
        array = np.asarray(points, dtype=np.float64)
        low, high = array.min(axis=0), array.max(axis=0)
        sx, sy, sz = (high - low).tolist()
        cx, cy, cz = ((high + low) / 2).tolist()
        return cls((sx, sy, sz), (cx, cy, cz))

    @property
    def corners(self) -> NDArray[np.float64]:
        """8×3 corners in the object's frame [m], the signs of x, y, z counting up in binary."""
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        return np.array(self.centre + signs * self.size / 2, dtype=np.float64)

    @property
    def T_object_body(self) -> RigidTransform:
        """Pose of the box's centre in the object."""
        return RigidTransform.from_translation(self.centre)


def body_behind(faces: Iterable[PlanarFace], thickness: float = FLAT_THICKNESS) -> BoxBody:
    """The box around faces and what lies behind them, up to a thickness [m] from each.

    Raises:
        InvalidInputError: the thickness is not positive and finite.
    """
    thickness = check_length(thickness, "thickness")
    points = []
    for face in faces:
        normal = face.T_object_face.rotation.apply([0.0, 0.0, 1.0])
        points += [face.object_corners, face.object_corners - thickness * normal]
    return BoxBody.around(np.vstack(points))
