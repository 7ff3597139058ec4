"""What `object.toml` holds: read strictly, written without losing a user's comments."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Literal

import tomlkit
import tomlkit.items
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from tomlkit.exceptions import TOMLKitError

from planegrasp.errors import LibraryError, SchemaVersionError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

__all__ = ["SCHEMA_VERSION", "FaceEntry", "ObjectEntry", "TransformEntry", "parse", "render"]

SCHEMA_VERSION = 1

_HEADER = (
    "An object of planegrasp; edit it freely. Lengths are in metres.",
    'T_object_face is the pose of a face in the object: "identity" or',
    "{translation = [x, y, z], quaternion = [x, y, z, w]}.",
)
_COMMENTS = {
    "priority": "larger is preferred",
    "width": "m, along the image's rows",
    "height": "m, along the image's columns",
    "image_size": "pixels, columns and rows; may be left out",
}

_Number = Annotated[float, Field(allow_inf_nan=False)]


class _Strict(BaseModel):
    """Unknown keys and wrong types are errors, so that a misspelt key is noticed."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class TransformEntry(_Strict):
    """A pose: translation [m] and quaternion (x, y, z, w)."""

    translation: tuple[_Number, _Number, _Number]
    quaternion: tuple[_Number, _Number, _Number, _Number]


class FaceEntry(_Strict):
    """One face, see `PlanarFace`; `image` is the name of a file beside `object.toml`."""

    name: str
    image: str = Field(pattern=r"^[^./\\][^/\\]*$")
    image_size: tuple[int, int] | None = None
    width: _Number = Field(gt=0)
    height: _Number = Field(gt=0)
    T_object_face: Literal["identity"] | TransformEntry = "identity"


class ObjectEntry(_Strict):
    """The whole file, see `ObjectModel`."""

    schema_version: int = SCHEMA_VERSION
    name: str
    priority: int = 0
    faces: tuple[FaceEntry, ...] = Field(min_length=1, max_length=6)


def parse(text: str, path: Path) -> ObjectEntry:
    """Read the text of an `object.toml`; `path` is what errors call it.

    Raises:
        SchemaVersionError: it was written by a newer planegrasp.
        LibraryError: it is not TOML (with the line), or a key is missing, unknown or wrong.
    """
    content = _load(text, path).unwrap()
    version = content.get("schema_version")
    if not isinstance(version, int) or version < 1:
        raise LibraryError(
            f"{path}: schema_version must be an integer from 1 to {SCHEMA_VERSION}, got {version!r}"
        )
    if version > SCHEMA_VERSION:
        raise SchemaVersionError(
            f"{path} has schema version {version}, this planegrasp reads up to version "
            f"{SCHEMA_VERSION}: update planegrasp"
        )
    try:
        return ObjectEntry.model_validate(content)
    except ValidationError as error:
        raise LibraryError(f"{path}: {_explain(error)}") from error


def render(entry: ObjectEntry, path: Path, existing: str | None = None) -> str:
    """The text of an `object.toml`; what `existing` has of comments, order and layout is kept.

    Raises:
        LibraryError: `existing` is not TOML; `path` is what the error calls it.
    """
    if existing is None:
        document = tomlkit.document()
        for line in _HEADER:
            document.add(tomlkit.comment(line))
        document.add(tomlkit.nl())
    else:
        document = _load(existing, path)
    content = entry.model_dump(exclude_none=True)
    faces = content.pop("faces")
    _update(document, content)
    _update_faces(document, faces)
    return tomlkit.dumps(document)


def _load(text: str, path: Path) -> tomlkit.TOMLDocument:
    try:
        return tomlkit.parse(text)
    except TOMLKitError as error:
        raise LibraryError(f"{path} is not valid TOML: {error}") from error


def _update(
    table: tomlkit.TOMLDocument | tomlkit.items.Table, content: Mapping[str, object]
) -> None:
    """Set the keys whose values differ, and remove those that are no longer there."""
    for key in [key for key in table if key not in content and key != "faces"]:
        table.remove(key)
    for key, value in content.items():
        present = key in table
        if present and _same(_plain(table[key]), _plain(value)):
            continue
        item = _item(value)
        if present:
            item.comment(table[key].trivia.comment.removeprefix("#").strip())
        elif key in _COMMENTS:
            item.comment(_COMMENTS[key])
        table[key] = item


def _update_faces(document: tomlkit.TOMLDocument, faces: list[dict[str, object]]) -> None:
    existing = {table["name"]: table for table in document.get("faces", [])}
    tables = []
    for face in faces:
        table = existing.get(face["name"])
        if table is None:
            table = tomlkit.table()
        _update(table, face)
        tables.append(table)
    if list(existing) != [face["name"] for face in faces]:
        array = tomlkit.aot()
        for table in tables:
            array.append(table)
        document["faces"] = array


def _item(value: object) -> tomlkit.items.Item:
    if isinstance(value, dict):
        table = tomlkit.inline_table()
        table.update({key: list(numbers) for key, numbers in value.items()})
        return table
    return tomlkit.item(list(value) if isinstance(value, tuple) else value)


def _plain(value: object) -> object:
    """The value with tuples as lists and without tomlkit's wrappers, for comparing."""
    if isinstance(value, tomlkit.items.Item):
        return _plain(value.unwrap())
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return value


def _same(a: object, b: object) -> bool:
    """Whether two plain values are equal, up to what rounding makes of a normalised quaternion."""
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_same, a, b))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_same(a[key], b[key]) for key in a)
    if isinstance(a, float) and isinstance(b, (int, float)):
        return math.isclose(a, b, rel_tol=1e-14, abs_tol=1e-14)
    return a == b


def _explain(error: ValidationError) -> str:
    """What was wrong, in one line: `faces[0].width: …, got -0.2`."""
    parts = []
    for item in error.errors():
        place = ""
        for step in item["loc"]:
            if isinstance(step, int):
                place += f"[{step}]"
            elif step not in ("TransformEntry", "literal['identity']"):
                place += f".{step}" if place else step
        if item["type"] == "extra_forbidden":
            parts.append(f"unknown key {place}")
        elif item["type"] == "missing":
            parts.append(f"{place} is missing")
        else:
            parts.append(f"{place}: {item['msg'].lower()}, got {item['input']!r}")
    return "; ".join(parts)
