"""TOML documents: read strictly, written without losing a user's comments, order and layout."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar, Self

import tomlkit
import tomlkit.items
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from tomlkit.exceptions import TOMLKitError

from planegrasp.errors import LibraryError, SchemaVersionError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

__all__ = ["Document", "Entry", "Number"]

Number = Annotated[float, Field(allow_inf_nan=False)]


class Entry(BaseModel):
    """Unknown keys and wrong types are errors, so that a misspelt key is noticed."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Document(Entry):
    """A whole file: values, and one array of tables that are told apart by their `name`.

    A subclass says with its class variables how it is written.

    Attributes:
        newest_version: of the schema; older ones must be readable too.
        tables: name of the field that is the array of tables.
        header: lines of comment for a new file.
        comments: what is written behind a new value, by its key.
    """

    newest_version: ClassVar[int]
    tables: ClassVar[str]
    header: ClassVar[tuple[str, ...]]
    comments: ClassVar[Mapping[str, str]]

    @classmethod
    def parse(cls, text: str, path: Path) -> Self:
        """Read the text of a file; `path` is what errors call it.

        Raises:
            SchemaVersionError: it was written by a newer planegrasp.
            LibraryError: it is not TOML (with the line), or a key is missing, unknown or wrong.
        """
        content = _load(text, path).unwrap()
        version, newest = content.get("schema_version"), cls.newest_version
        if not isinstance(version, int) or version < 1:
            raise LibraryError(
                f"{path}: schema_version must be an integer from 1 to {newest}, got {version!r}"
            )
        if version > newest:
            raise SchemaVersionError(
                f"{path} has schema version {version}, this planegrasp reads up to version "
                f"{newest}: update planegrasp"
            )
        try:
            return cls.model_validate(content)
        except ValidationError as error:
            raise LibraryError(f"{path}: {_explain(error)}") from error

    def render(self, path: Path, existing: str | None = None) -> str:
        """The text of the file; what `existing` has of comments, order and layout is kept.

        Raises:
            LibraryError: `existing` is not TOML; `path` is what the error calls it.
        """
        if existing is None:
            document = tomlkit.document()
            for line in self.header:
                document.add(tomlkit.comment(line))
            document.add(tomlkit.nl())
        else:
            document = _load(existing, path)
        content = self.model_dump(exclude_none=True)
        entries = content.pop(self.tables)
        self._update(document, content)
        self._update_tables(document, entries)
        return tomlkit.dumps(document)

    def _update(
        self, table: tomlkit.TOMLDocument | tomlkit.items.Table, content: Mapping[str, object]
    ) -> None:
        """Set the keys whose values differ, and remove those that are no longer there."""
        for key in [key for key in table if key not in content and key != self.tables]:
            table.remove(key)
        for key, value in content.items():
            present = key in table
            if present and _same(_plain(table[key]), _plain(value)):
                continue
            item = _item(value)
            if present:
                item.comment(table[key].trivia.comment.removeprefix("#").strip())
            elif key in self.comments:
                item.comment(self.comments[key])
            table[key] = item

    def _update_tables(
        self, document: tomlkit.TOMLDocument, entries: list[dict[str, object]]
    ) -> None:
        existing = {table["name"]: table for table in document.get(self.tables, [])}
        tables = []
        for entry in entries:
            table = existing.get(entry["name"])
            if table is None:
                table = tomlkit.table()
            self._update(table, entry)
            tables.append(table)
        if list(existing) == [entry["name"] for entry in entries]:
            return
        array = tomlkit.aot()
        for table in tables:
            array.append(table)
        if tables:
            document[self.tables] = array
        else:
            document.remove(self.tables)


def _load(text: str, path: Path) -> tomlkit.TOMLDocument:
    try:
        return tomlkit.parse(text)
    except TOMLKitError as error:
        raise LibraryError(f"{path} is not valid TOML: {error}") from error


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
