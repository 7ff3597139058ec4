"""One object on disk: reading it strictly, replacing it so that a kill never leaves half of it.

    NAME/object.toml          what `planegrasp.library.schema` says
    NAME/FACE-<digest>.png    one image a face, named by its content
    NAME/cache/               features, safe to delete

A new object is built in a temporary folder and renamed. A changed one first gets its new images,
which nobody refers to yet; renaming its new `object.toml` over the old one is the instant of the
change; then images that are no longer referred to are deleted. Names that start with '.' are
temporary; the next save deletes what a killed one left.
"""

from __future__ import annotations

import fcntl
import os
import re
import secrets
import shutil
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from planegrasp.errors import LibraryError, PlanegraspError, UnknownObjectError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.io.atomic import sync_folder, write_atomically
from planegrasp.io.images import read_color, write_color
from planegrasp.library.schema import FaceEntry, ObjectEntry, TransformEntry, parse, render
from planegrasp.objects import ObjectModel, PlanarFace

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

__all__ = ["Scan", "StoredObject", "cache_folder", "clean", "delete", "locked", "scan", "write"]

_OBJECT_FILE = "object.toml"
_CACHE = "cache"
_OWN_IMAGE = re.compile(r".+-[0-9a-f]{16}\.png")
_TEMPORARY = re.compile(r"\..+\.[0-9a-f]+\.tmp")


@dataclass(frozen=True, slots=True, eq=False)
class StoredObject:
    """An object as it is on disk: the model, and the image file of each face by the face's name."""

    model: ObjectModel
    images: dict[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """What is in a library's folder: the good objects, and why each damaged one cannot be read."""

    objects: dict[str, StoredObject] = field(default_factory=dict)
    damaged: dict[str, LibraryError] = field(default_factory=dict)


def scan(root: Path) -> Scan:
    """Read every object of a library; a folder that does not exist is an empty library.

    Raises:
        LibraryError: root is not a folder or cannot be read. Damaged objects do not raise.
    """
    result = Scan()
    if not root.exists():
        return result
    if not root.is_dir():
        raise LibraryError(f"{root} is a file: a library is a folder")
    with locked(root, exclusive=False):
        for folder in sorted(root.iterdir()):
            if not folder.is_dir() or folder.name.startswith("."):
                continue
            try:
                clash = next((n for n in result.objects if n.lower() == folder.name.lower()), None)
                if clash:
                    raise LibraryError(
                        f"{folder} and {root / clash} differ only in upper and lower case: "
                        f"rename one of them, in its {_OBJECT_FILE} too"
                    )
                result.objects[folder.name] = _read(folder)
            except LibraryError as error:
                result.damaged[folder.name] = error
    return result


def write(root: Path, model: ObjectModel, stored: StoredObject | None) -> StoredObject:
    """Write an object, new or in the place of `stored`, so that a kill leaves one or the other.

    Call it with the library locked.

    Raises:
        LibraryError: a folder or file cannot be written.
    """
    entry = _entry(model, stored)
    folder = root / model.name
    try:
        if folder.is_dir():
            _replace(folder, entry, model, stored)
        else:
            _create(folder, entry, model)
    except OSError as error:
        raise LibraryError(f"{folder} cannot be written: {error}") from error
    return StoredObject(model, {face.name: face.image for face in entry.faces})


def delete(root: Path, name: str) -> None:
    """Delete an object, good or damaged, at once: its folder is renamed before it is emptied.

    Call it with the library locked.

    Raises:
        UnknownObjectError: there is no such folder.
        LibraryError: it cannot be deleted.
    """
    folder = root / name
    if name.startswith(".") or folder.parent != root or not folder.is_dir():
        raise UnknownObjectError(f"there is no object {name!r} in {root}")
    try:
        doomed = folder.rename(_temporary(folder))
        sync_folder(root)
        shutil.rmtree(doomed)
    except OSError as error:
        raise LibraryError(f"{folder} cannot be deleted: {error}") from error


def clean(root: Path) -> None:
    """Delete what killed saves left behind. Call it with the library locked."""
    for pattern in (".*.tmp", "*/.*.tmp", f"*/{_CACHE}/.*.tmp"):
        for path in root.glob(pattern):
            if not _TEMPORARY.fullmatch(path.name):
                continue
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def cache_folder(root: Path, name: str) -> Path:
    """Where features of an object are kept."""
    return root / name / _CACHE


@contextmanager
def locked(root: Path, *, exclusive: bool) -> Iterator[None]:
    """Hold the library's lock: one process may write it, or several may read it.

    Raises:
        LibraryError: the folder cannot be opened.
    """
    try:
        descriptor = os.open(root, os.O_RDONLY)
    except OSError as error:
        raise LibraryError(f"{root} cannot be read: {error.strerror}") from error
    try:
        # Some network file systems have no locks: there one process at a time must do.
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH)
        yield
    finally:
        os.close(descriptor)


def _read(folder: Path) -> StoredObject:
    path = folder / _OBJECT_FILE
    entry = parse(_read_text(path), path)
    if entry.name != folder.name:
        raise LibraryError(
            f"{path} is named {entry.name!r} but its folder {folder.name!r}: "
            f"make them the same to rename the object"
        )
    try:
        faces = tuple(_read_face(folder, face) for face in entry.faces)
        model = ObjectModel(entry.name, faces, entry.priority)
    except LibraryError:
        raise
    except PlanegraspError as error:
        raise LibraryError(f"{path}: {error}") from error
    return StoredObject(model, {face.name: face.image for face in entry.faces})


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise LibraryError(
            f"{path.parent} has no {_OBJECT_FILE}: restore it, or move the folder elsewhere"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise LibraryError(f"{path} cannot be read: {error}") from error


def _read_face(folder: Path, entry: FaceEntry) -> PlanarFace:
    image = read_color(folder / entry.image)
    size = (image.shape[1], image.shape[0])
    if entry.image_size not in (None, size):
        expected = "×".join(map(str, entry.image_size or ()))
        raise LibraryError(
            f"{folder / entry.image} is {size[0]}×{size[1]} pixels, {_OBJECT_FILE} says "
            f"{expected}: if the image was replaced on purpose, correct or remove image_size"
        )
    T_object_face = _transform(entry.T_object_face, folder / _OBJECT_FILE)
    return PlanarFace(entry.name, image, entry.width, entry.height, T_object_face)


def _transform(entry: TransformEntry | str, path: Path) -> RigidTransform:
    if not isinstance(entry, TransformEntry):
        return RigidTransform.identity()
    norm = float(np.linalg.norm(entry.quaternion))
    if abs(norm - 1.0) > 1e-3:
        raise LibraryError(
            f"{path}: quaternion {list(entry.quaternion)} has length {norm:.4g}, a rotation has 1"
        )
    return RigidTransform.from_components(entry.translation, Rotation.from_quat(entry.quaternion))


def _entry(model: ObjectModel, stored: StoredObject | None) -> ObjectEntry:
    faces = []
    for face in model.faces:
        rows, columns = face.image.shape[:2]
        faces.append(
            FaceEntry(
                name=face.name,
                image=_image_name(face, stored),
                image_size=(columns, rows),
                width=face.width,
                height=face.height,
                T_object_face=_transform_entry(face.T_object_face),
            )
        )
    return ObjectEntry(name=model.name, priority=model.priority, faces=tuple(faces))


def _image_name(face: PlanarFace, stored: StoredObject | None) -> str:
    """The file of the same image as it is stored already, else a name made of the content."""
    digest = face.image_digest
    if stored:
        for old in stored.model.faces:
            if old.name == face.name and old.image_digest == digest:
                return stored.images[old.name]
    return f"{face.name}-{digest[:16]}.png"


def _transform_entry(T: RigidTransform) -> TransformEntry | Literal["identity"]:
    if np.array_equal(T.as_matrix(), np.eye(4)):
        return "identity"
    x, y, z, w = T.rotation.as_quat(canonical=True).tolist()
    tx, ty, tz = T.translation.tolist()
    return TransformEntry(translation=(tx, ty, tz), quaternion=(x, y, z, w))


def _create(folder: Path, entry: ObjectEntry, model: ObjectModel) -> None:
    building = _temporary(folder)
    building.mkdir()
    for face, face_entry in zip(model.faces, entry.faces, strict=True):
        write_color(building / face_entry.image, face.image)
    write_atomically(building / _OBJECT_FILE, render(entry, folder / _OBJECT_FILE).encode())
    building.rename(folder)
    sync_folder(folder.parent)


def _replace(
    folder: Path, entry: ObjectEntry, model: ObjectModel, stored: StoredObject | None
) -> None:
    kept = set(stored.images.values()) if stored else set()
    for face, face_entry in zip(model.faces, entry.faces, strict=True):
        if face_entry.image not in kept:
            write_color(folder / face_entry.image, face.image)
    path = folder / _OBJECT_FILE
    existing = path.read_text(encoding="utf-8")
    write_atomically(path, render(entry, path, existing).encode())
    _drop_unused(folder, {face.image for face in entry.faces})


def _drop_unused(folder: Path, used: set[str]) -> None:
    """Delete images that nobody refers to, and the features of them."""
    unused = [p for p in folder.iterdir() if _OWN_IMAGE.fullmatch(p.name) and p.name not in used]
    for path in unused:
        path.unlink()
    if unused:
        shutil.rmtree(folder / _CACHE, ignore_errors=True)


def _temporary(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}.{secrets.token_hex(6)}.tmp")
