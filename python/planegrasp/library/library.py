"""The library: the objects that a detector looks for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from planegrasp.errors import (
    DuplicateObjectError,
    LibraryError,
    SchemaVersionError,
    UnknownObjectError,
)
from planegrasp.grasping import check_unique
from planegrasp.library import storage

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planegrasp.objects import ObjectModel

__all__ = ["ObjectLibrary"]


class ObjectLibrary:
    """Objects by name, and the folder that they are kept in.

    The folder is read when the library is made, and created by the first `save`. Objects come in
    the order of their names, so that a library gives the same results after it was stored.

    Args:
        path: the library's folder; it need not exist. None keeps the library in memory only.

    Raises:
        SchemaVersionError: an object was written by a newer planegrasp.
        LibraryError: path is a file, or objects are damaged; the message lists them all.
    """

    def __init__(self, path: str | Path | None = None) -> None:
        self._path = None if path is None else Path(path)
        found = storage.scan(self._path) if self._path else storage.Scan()
        _refuse_damaged(found, self._path)
        self._stored = found.objects
        self._models = {name: stored.model for name, stored in found.objects.items()}

    @property
    def path(self) -> Path | None:
        """The library's folder, or None for a library in memory."""
        return self._path

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all objects, sorted."""
        return tuple(sorted(self._models))

    def __len__(self) -> int:
        return len(self._models)

    def __iter__(self) -> Iterator[ObjectModel]:
        return iter([self._models[name] for name in self.names])

    def __contains__(self, name: object) -> bool:
        return name in self._models

    def __getitem__(self, name: str) -> ObjectModel:
        self._check_known(name)
        return self._models[name]

    def __repr__(self) -> str:
        place = "in memory" if self._path is None else repr(str(self._path))
        return f"ObjectLibrary({place}: {', '.join(self.names) or 'empty'})"

    def add(self, model: ObjectModel, *, replace: bool = False) -> None:
        """Add an object; `save` writes it.

        Args:
            model: the object.
            replace: take the place of an object of the same name, with the grasps of the new one.

        Raises:
            DuplicateObjectError: an object has that name already and replace is False, or has it
                in other upper and lower case, which not every file system tells apart.
        """
        for name in self._models:
            if name.lower() == model.name.lower() and (name != model.name or not replace):
                hint = (
                    "replace it (replace=True) or choose another name"
                    if name == model.name
                    else "names must differ in more than upper and lower case"
                )
                raise DuplicateObjectError(f"there is an object {name!r} already: {hint}")
        self._models[model.name] = model

    def remove(self, name: str) -> None:
        """Remove an object; `save` deletes its folder.

        Raises:
            UnknownObjectError: there is no object of that name.
        """
        self._check_known(name)
        del self._models[name]

    def save(self) -> None:
        """Write what changed since the library was read or saved, objects and their grasps.

        Each object changes at one instant: a kill leaves it as it was or as it will be, and never
        touches an object that did not change.

        Raises:
            LibraryError: the library is in memory only, or its folder cannot be written.
            GraspError: two grasps of an object have one name, or something else is among the
                grasps; nothing is written.
            DuplicateObjectError: another process added an object of the same name meanwhile.
        """
        if self._path is None:
            raise LibraryError("a library in memory cannot be saved: make it with a path")
        for model in self:
            check_unique(model.grasps, model.name)
        try:
            self._path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise LibraryError(f"{self._path} cannot be created: {error}") from error
        with storage.locked(self._path, exclusive=True):
            storage.clean(self._path)
            for name in sorted(set(self._stored) - set(self._models)):
                if (self._path / name).is_dir():
                    storage.delete(self._path, name)
                del self._stored[name]
            for name in self.names:
                self._save_object(self._path, name)

    def cache_dir(self, name: str) -> Path | None:
        """Folder for what can be computed from an object again; it need not exist.

        None where the library is in memory, or the object is not stored as it is here.

        Raises:
            UnknownObjectError: there is no object of that name.
        """
        self._check_known(name)
        stored = self._stored.get(name)
        if self._path is None or stored is None or stored.model is not self._models[name]:
            return None
        return storage.cache_folder(self._path, name)

    def _save_object(self, path: Path, name: str) -> None:
        stored = self._stored.get(name)
        model = self._models[name]
        if stored and stored.holds(model):
            return
        if stored is None and (path / name).exists():
            raise DuplicateObjectError(
                f"{path / name} was created since this library was opened: open it again"
            )
        self._stored[name] = storage.write(path, model, stored)

    def _check_known(self, name: str) -> None:
        if name not in self._models:
            known = ", ".join(self.names) or "it is empty"
            raise UnknownObjectError(f"the library has no object {name!r}; it has: {known}")


def _refuse_damaged(found: storage.Scan, path: Path | None) -> None:
    errors = list(found.damaged.values())
    if len(errors) == 1:
        raise errors[0]
    if errors:
        kind = LibraryError
        if all(isinstance(error, SchemaVersionError) for error in errors):
            kind = SchemaVersionError
        listing = "".join(f"\n  {error}" for error in errors)
        raise kind(f"{len(errors)} objects of {path} cannot be read:{listing}")
