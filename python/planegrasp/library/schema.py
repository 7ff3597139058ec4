"""What `object.toml` and `grasps.toml` hold."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from planegrasp.library.documents import Document, Entry, Number

__all__ = ["BodyEntry", "FaceEntry", "GraspEntry", "GraspsFile", "ObjectFile", "TransformEntry"]

_Triple = tuple[Number, Number, Number]
_Quaternion = tuple[Number, Number, Number, Number]


class TransformEntry(Entry):
    """A pose: translation [m] and quaternion (x, y, z, w)."""

    translation: _Triple
    quaternion: _Quaternion


class FaceEntry(Entry):
    """One face, see `PlanarFace`; `image` is the name of a file beside `object.toml`."""

    name: str
    image: str = Field(pattern=r"^[^./\\][^/\\]*$")
    image_size: tuple[int, int] | None = None
    width: Number = Field(gt=0)
    height: Number = Field(gt=0)
    T_object_face: Literal["identity"] | TransformEntry = "identity"


class BodyEntry(Entry):
    """The outer box of an object, see `BoxBody`."""

    size: _Triple
    centre: _Triple = (0.0, 0.0, 0.0)


class ObjectFile(Document):
    """The whole `object.toml`, see `ObjectModel`. Version 1 had no body."""

    newest_version = 2
    tables = "faces"
    header = (
        "An object of planegrasp; edit it freely. Lengths are in metres.",
        'T_object_face is the pose of a face in the object: "identity" or',
        "{translation = [x, y, z], quaternion = [x, y, z, w]}.",
    )
    comments: ClassVar = {
        "priority": "larger is preferred",
        "body": "m, the object's outer box: may be left out",
        "width": "m, along the image's rows",
        "height": "m, along the image's columns",
        "image_size": "pixels, columns and rows; may be left out",
    }

    schema_version: int = newest_version
    name: str
    priority: int = 0
    body: BodyEntry | None = None
    faces: tuple[FaceEntry, ...] = Field(min_length=1, max_length=6)


class GraspEntry(Entry):
    """One grasp, see `CanonicalGrasp`: the pose of the gripper in the object, and how it closes."""

    name: str
    translation: _Triple
    quaternion: _Quaternion
    opening: Number
    approach: _Triple = (1.0, 0.0, 0.0)
    pregrasp_distance: Number = 0.10
    force: Number = 40.0


class GraspsFile(Document):
    """The whole `grasps.toml`."""

    newest_version = 1
    tables = "grasps"
    header = (
        "Grasps of an object of planegrasp; edit them freely. Lengths are in metres, forces in",
        "newtons. The pose is that of the gripper in the object: the gripper's origin lies between",
        "its fingertips, x points out of its palm, its fingers close along y.",
    )
    comments: ClassVar = {
        "quaternion": "x, y, z, w",
        "opening": "m, between the fingertips while the gripper moves over the object",
        "approach": "unit vector in the gripper's frame",
        "pregrasp_distance": "m, how far before the grasp the gripper starts",
        "force": "N, with which the fingers close",
    }

    schema_version: int = newest_version
    grasps: tuple[GraspEntry, ...] = ()
