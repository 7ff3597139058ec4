"""What happened to the library of objects."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planegrasp.geometry import RigidTransform
    from planegrasp.io.messages.header import Stamp
    from planegrasp.objects import ObjectModel

__all__ = ["FaceSize", "LibraryEvent", "LibraryEventKind", "library_events"]


class LibraryEventKind(StrEnum):
    """What happened to an object of the library."""

    ADDED = "added"
    CHANGED = "changed"
    REMOVED = "removed"


@dataclass(frozen=True, slots=True)
class FaceSize:
    """A face of an object.

    Attributes:
        name: of the face.
        width: [m].
        height: [m].
        image_digest: of its reference image: it changes where the image does.
    """

    name: str
    width: float
    height: float
    image_digest: str


@dataclass(frozen=True, slots=True)
class LibraryEvent:
    """One thing that happened to one object of the library.

    Attributes:
        stamp: when it was noticed.
        kind: what happened.
        name: of the object.
        priority: of the object, as of now; as of before where it was removed, as all that follows.
        faces: of the object.
        grasps: names of its grasps.
    """

    stamp: Stamp
    kind: LibraryEventKind
    name: str
    priority: int
    faces: tuple[FaceSize, ...]
    grasps: tuple[str, ...]


def library_events(
    before: Iterable[ObjectModel], after: Iterable[ObjectModel], stamp: Stamp
) -> tuple[LibraryEvent, ...]:
    """What was added to a library, changed in it and removed from it, by name.

    Args:
        before: its objects; none where everything in it is news.
        after: its objects now.
        stamp: when this was noticed.
    """
    old = {model.name: model for model in before}
    new = {model.name: model for model in after}
    events = []
    for name in sorted(old.keys() | new.keys()):
        if name not in new:
            events.append(_event(LibraryEventKind.REMOVED, old[name], stamp))
        elif name not in old:
            events.append(_event(LibraryEventKind.ADDED, new[name], stamp))
        elif _content(old[name]) != _content(new[name]):
            events.append(_event(LibraryEventKind.CHANGED, new[name], stamp))
    return tuple(events)


def _event(kind: LibraryEventKind, model: ObjectModel, stamp: Stamp) -> LibraryEvent:
    faces = tuple(FaceSize(f.name, f.width, f.height, f.image_digest) for f in model.faces)
    grasps = tuple(grasp.name for grasp in model.grasps)
    return LibraryEvent(stamp, kind, model.name, model.priority, faces, grasps)


def _content(model: ObjectModel) -> tuple[object, ...]:
    """All that can change in an object, comparable."""
    faces = [
        (f.name, f.width, f.height, f.image_digest, _matrix(f.T_object_face)) for f in model.faces
    ]
    grasps = [
        (g.name, _matrix(g.T_object_gripper), g.opening, g.approach, g.pregrasp_distance, g.force)
        for g in model.grasps
    ]
    return model.priority, model.body, faces, grasps


def _matrix(T: RigidTransform) -> list[list[float]]:
    matrix: list[list[float]] = T.as_matrix().tolist()
    return matrix
