"""One object on disk: reading it strictly, replacing it so that a kill never leaves half of it.

    NAME/object.toml          what `planegrasp.library.schema` says
    NAME/grasps.toml          the same, where there are grasps
    NAME/FACE-<digest>.png    one image a face, named by its content
    NAME/cache/               features, safe to delete

A new object is built in a temporary folder and renamed. A changed one first gets its new images,
which nobody refers to yet; then its TOML files are changed, at one instant (`journal`); then images
that are no longer referred to are deleted. Names that start with '.' are temporary; the next save
deletes or completes what a killed one left.
"""

from __future__ import annotations

import fcntl
import os
import re
import secrets
import shutil
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planegrasp.errors import LibraryError, UnknownObjectError
from planegrasp.io.atomic import sync_folder, write_atomically
from planegrasp.io.images import write_color
from planegrasp.library import journal
from planegrasp.library.entries import grasps_file, object_file, read_grasps, read_object

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from planegrasp.grasping import CanonicalGrasp
    from planegrasp.objects import ObjectModel, PlanarFace

__all__ = ["Scan", "StoredObject", "cache_folder", "clean", "delete", "locked", "scan", "write"]

_OBJECT_FILE = "object.toml"
_GRASPS_FILE = "grasps.toml"
_CACHE = "cache"
_OWN_IMAGE = re.compile(r".+-[0-9a-f]{16}\.png")
_TEMPORARY = re.compile(r"\..+\.[0-9a-f]+\.tmp")


@dataclass(frozen=True, slots=True, eq=False)
class StoredObject:
    """An object as it is on disk.

    Attributes:
        model: the object.
        images: the image file of each face, by the face's name.
        grasps: the grasps as they are on disk; those of `model` may have changed since.
    """

    model: ObjectModel
    images: dict[str, str]
    grasps: tuple[CanonicalGrasp, ...]

    def holds(self, model: ObjectModel) -> bool:
        """Whether this is on disk, grasps included."""
        return self.model is model and self.holds_grasps(model)

    def holds_grasps(self, model: ObjectModel) -> bool:
        """Whether these grasps are on disk, in this order."""
        return len(self.grasps) == len(model.grasps) and all(
            mine is other for mine, other in zip(self.grasps, model.grasps, strict=True)
        )


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

    What is the same in `stored` is not written. Call it with the library locked.

    Raises:
        LibraryError: a folder or file cannot be written.
    """
    folder = root / model.name
    unchanged = stored is not None and stored.model is model and folder.is_dir()
    images = (
        stored.images
        if stored and unchanged
        else {face.name: _image_name(face, stored) for face in model.faces}
    )
    try:
        if unchanged:
            journal.change(folder, _grasps_text(folder, model))
        elif folder.is_dir():
            _replace(folder, model, images, stored)
        else:
            _create(folder, model, images)
    except OSError as error:
        raise LibraryError(f"{folder} cannot be written: {error}") from error
    return StoredObject(model, images, tuple(model.grasps))


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
    """Delete or complete what killed saves left behind. Call it with the library locked."""
    for path in root.glob(f"*/{journal.JOURNAL}"):
        # One that is damaged is not of a killed save: reading its object says so.
        with suppress(LibraryError, OSError):
            journal.finish(path.parent)
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
    text = journal.read(path)
    if text is None:
        raise LibraryError(
            f"{folder} has no {_OBJECT_FILE}: restore it, or move the folder elsewhere"
        )
    grasps_path = folder / _GRASPS_FILE
    grasps = read_grasps(grasps_path, journal.read(grasps_path))
    model, images = read_object(path, text, grasps)
    return StoredObject(model, images, tuple(grasps))


def _image_name(face: PlanarFace, stored: StoredObject | None) -> str:
    """The file of the same image as it is stored already, else a name made of the content."""
    digest = face.image_digest
    if stored:
        for old in stored.model.faces:
            if old.name == face.name and old.image_digest == digest:
                return stored.images[old.name]
    return f"{face.name}-{digest[:16]}.png"


def _create(folder: Path, model: ObjectModel, images: dict[str, str]) -> None:
    building = _temporary(folder)
    building.mkdir()
    for face in model.faces:
        write_color(building / images[face.name], face.image)
    texts = {_OBJECT_FILE: object_file(model, images).render(folder / _OBJECT_FILE)}
    if model.grasps:
        texts |= _grasps_text(folder, model)
    for name, text in texts.items():
        write_atomically(building / name, text.encode())
    building.rename(folder)
    sync_folder(folder.parent)


def _replace(
    folder: Path, model: ObjectModel, images: dict[str, str], stored: StoredObject | None
) -> None:
    kept = set(stored.images.values()) if stored else set()
    for face in model.faces:
        if images[face.name] not in kept:
            write_color(folder / images[face.name], face.image)
    path = folder / _OBJECT_FILE
    texts = {path.name: object_file(model, images).render(path, journal.read(path))}
    if stored is None or not stored.holds_grasps(model):
        texts |= _grasps_text(folder, model)
    journal.change(folder, texts)
    _drop_unused(folder, set(images.values()))


def _grasps_text(folder: Path, model: ObjectModel) -> dict[str, str]:
    path = folder / _GRASPS_FILE
    return {path.name: grasps_file(model.grasps).render(path, journal.read(path))}


def _drop_unused(folder: Path, used: set[str]) -> None:
    """Delete images that nobody refers to, and the features of them."""
    unused = [p for p in folder.iterdir() if _OWN_IMAGE.fullmatch(p.name) and p.name not in used]
    for path in unused:
        path.unlink()
    if unused:
        shutil.rmtree(folder / _CACHE, ignore_errors=True)


def _temporary(folder: Path) -> Path:
    return folder.with_name(f".{folder.name}.{secrets.token_hex(6)}.tmp")
