"""From the values of the package to the entries of the library's files, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from planegrasp.body import BoxBody
from planegrasp.errors import LibraryError, PlanegraspError
from planegrasp.geometry import RigidTransform, transform_from_quaternion
from planegrasp.grasping import CanonicalGrasp, check_unique
from planegrasp.io.images import read_color
from planegrasp.library.schema import (
    BodyEntry,
    FaceEntry,
    GraspEntry,
    GraspsFile,
    ObjectFile,
    TransformEntry,
)
from planegrasp.objects import ObjectModel, PlanarFace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

__all__ = ["grasps_file", "object_file", "read_grasps", "read_object"]


def read_object(
    path: Path, text: str, grasps: Iterable[CanonicalGrasp]
) -> tuple[ObjectModel, dict[str, str]]:
    """The object that the text of an `object.toml` describes, and its images by face.

    The images lie beside the file, at `path`.

    Raises:
        LibraryError: see `ObjectFile.parse`; or an image or a value is not one of an object.
    """
    file = ObjectFile.parse(text, path)
    folder = path.parent
    if file.name != folder.name:
        raise LibraryError(
            f"{path} is named {file.name!r} but its folder {folder.name!r}: "
            f"make them the same to rename the object"
        )
    try:
        faces = tuple(_face(path, face) for face in file.faces)
        body = BoxBody(file.body.size, file.body.centre) if file.body else None
        model = ObjectModel(file.name, faces, file.priority, body, list(grasps))
    except LibraryError:
        raise
    except PlanegraspError as error:
        raise LibraryError(f"{path}: {error}") from error
    return model, {face.name: face.image for face in file.faces}


def read_grasps(path: Path, text: str | None) -> list[CanonicalGrasp]:
    """The grasps in the text of a `grasps.toml`; no file, no grasps.

    Raises:
        LibraryError: see `GraspsFile.parse`; or a value is not one of a grasp, or two grasps have
            one name.
    """
    if text is None:
        return []
    try:
        grasps = [_grasp(entry) for entry in GraspsFile.parse(text, path).grasps]
        check_unique(grasps, path.parent.name)
    except LibraryError:
        raise
    except PlanegraspError as error:
        raise LibraryError(f"{path}: {error}") from error
    return grasps


def object_file(model: ObjectModel, images: Mapping[str, str]) -> ObjectFile:
    """What `object.toml` says of an object; `images` names each face's image file."""
    faces = []
    for face in model.faces:
        rows, columns = face.image.shape[:2]
        faces.append(
            FaceEntry(
                name=face.name,
                image=images[face.name],
                image_size=(columns, rows),
                width=face.width,
                height=face.height,
                T_object_face=_transform_entry(face.T_object_face),
            )
        )
    body = BodyEntry(size=model.body.size, centre=model.body.centre) if model.body else None
    return ObjectFile(name=model.name, priority=model.priority, body=body, faces=tuple(faces))


def grasps_file(grasps: Iterable[CanonicalGrasp]) -> GraspsFile:
    """What `grasps.toml` says of grasps."""
    entries = []
    for grasp in grasps:
        pose = _pose_entry(grasp.T_object_gripper)
        entries.append(
            GraspEntry(
                name=grasp.name,
                translation=pose.translation,
                quaternion=pose.quaternion,
                opening=grasp.opening,
                approach=grasp.approach,
                pregrasp_distance=grasp.pregrasp_distance,
                force=grasp.force,
            )
        )
    return GraspsFile(grasps=tuple(entries))


def _face(path: Path, entry: FaceEntry) -> PlanarFace:
    image = read_color(path.parent / entry.image)
    size = (image.shape[1], image.shape[0])
    if entry.image_size not in (None, size):
        expected = "×".join(map(str, entry.image_size or ()))
        raise LibraryError(
            f"{path.parent / entry.image} is {size[0]}×{size[1]} pixels, {path.name} says "
            f"{expected}: if the image was replaced on purpose, correct or remove image_size"
        )
    T_object_face = RigidTransform.identity()
    if isinstance(entry.T_object_face, TransformEntry):
        T_object_face = transform_from_quaternion(
            entry.T_object_face.translation, entry.T_object_face.quaternion
        )
    return PlanarFace(entry.name, image, entry.width, entry.height, T_object_face)


def _grasp(entry: GraspEntry) -> CanonicalGrasp:
    return CanonicalGrasp(
        entry.name,
        transform_from_quaternion(entry.translation, entry.quaternion),
        entry.opening,
        entry.approach,
        entry.pregrasp_distance,
        entry.force,
    )


def _transform_entry(T: RigidTransform) -> TransformEntry | Literal["identity"]:
    return "identity" if np.array_equal(T.as_matrix(), np.eye(4)) else _pose_entry(T)


def _pose_entry(T: RigidTransform) -> TransformEntry:
    x, y, z, w = T.rotation.as_quat(canonical=True).tolist()
    tx, ty, tz = T.translation.tolist()
    return TransformEntry(translation=(tx, ty, tz), quaternion=(x, y, z, w))
