"""What is around the robot: boxes, and the object that is to be grasped or is held."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from planegrasp.checks import check_length
from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planegrasp.geometry import RigidTransform

OBJECT = "object"


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle:
    """A box that stands still.

    Attributes:
        name: how refusals call it.
        size: of its edges along its own x, y and z [m].
        T_base_box: pose of its centre.
    """

    name: str
    size: tuple[float, float, float]
    T_base_box: RigidTransform

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", _checked_size(self.size, self.name))
        if not self.name or self.name == OBJECT:
            raise InvalidInputError(f"an obstacle needs a name other than {OBJECT!r}")


@dataclass(frozen=True, slots=True, eq=False)
class ObjectBody:
    """The outer box of the object, lying somewhere or held by the gripper.

    Attributes:
        size: of its edges along the object's x, y and z [m].
        T_base_object: where it lies; None while it is held.
        T_gripper_object: how it is held; None while it lies somewhere.
        centre: of the box in the object's frame [m].
        supports: names of obstacles that it may touch, such as the table it stands on.
    """

    size: tuple[float, float, float]
    T_base_object: RigidTransform | None = None
    T_gripper_object: RigidTransform | None = None
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    supports: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", _checked_size(self.size, OBJECT))
        object.__setattr__(self, "supports", frozenset(self.supports))
        if (self.T_base_object is None) == (self.T_gripper_object is None):
            raise InvalidInputError(
                "an object either lies at T_base_object or is held at T_gripper_object: give one"
            )

    def held(self, T_gripper_object: RigidTransform) -> ObjectBody:
        """The same object in the gripper."""
        return replace(self, T_base_object=None, T_gripper_object=T_gripper_object)

    def lying(self, T_base_object: RigidTransform) -> ObjectBody:
        """The same object somewhere."""
        return replace(self, T_base_object=T_base_object, T_gripper_object=None)


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Obstacles and at most one object.

    Attributes:
        obstacles: with different names.
        object: that is to be grasped or is held.
    """

    obstacles: tuple[Obstacle, ...] = field(default=())
    object: ObjectBody | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "obstacles", tuple(self.obstacles))
        names = [obstacle.name for obstacle in self.obstacles]
        if len(set(names)) != len(names):
            raise InvalidInputError(f"obstacles need different names, got {', '.join(names)}")
        if self.object is not None:
            self.check_names(self.object.supports)

    def with_object(self, body: ObjectBody | None) -> Scene:
        """The same obstacles with another object, or none."""
        return replace(self, object=body)

    def check_names(self, wanted: Iterable[str]) -> None:
        """Refuse, with an InvalidInputError, names that no obstacle has."""
        names = [obstacle.name for obstacle in self.obstacles]
        unknown = set(wanted) - set(names)
        if unknown:
            raise InvalidInputError(
                f"no obstacle is called {', '.join(sorted(unknown))}; there are: "
                f"{', '.join(names) or 'none'}"
            )


def _checked_size(size: tuple[float, float, float], name: str) -> tuple[float, float, float]:
    if len(size) != 3:
        raise InvalidInputError(f"the size of {name!r} is (x, y, z) in metres, got {size}")
    x, y, z = (check_length(edge, f"an edge of {name!r}") for edge in size)
    return x, y, z
