"""The message model as JSON with a schema, for what Foxglove has no schema of.

Members keep their names. Foxglove's reader of schemas knows objects, lists of objects and lists of
numbers or texts, so a tuple in a tuple becomes an object: `values` of numbers (corners, points of a
path), `name` and `value` of a figure. What is None is null.
"""

from __future__ import annotations

import json
import math
from dataclasses import fields, is_dataclass
from enum import Enum
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from planegrasp.io import messages

__all__ = ["document_of", "encoded", "schema_of"]

_NUMBERS, _NAME, _VALUE = "values", "name", "value"
_PLAIN = {bool: "boolean", int: "integer", float: "number", str: "string"}


def encoded(message: Any) -> bytes:
    """A message of `planegrasp.io.messages` as JSON; what is not finite is null."""
    return json.dumps(document_of(message), ensure_ascii=False, allow_nan=False).encode()


def document_of(value: Any) -> Any:
    """A value of a message, ready for `json.dumps`."""
    if is_dataclass(value):
        return {one.name: document_of(getattr(value, one.name)) for one in fields(value)}
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, tuple):
        return [_item(one) if isinstance(one, tuple) else document_of(one) for one in value]
    return value


def schema_of(message: type) -> dict[str, Any]:
    """The JSON schema of a message's type; its title is ``planegrasp.NAME``."""
    return {"title": f"planegrasp.{message.__name__}", **_schema(message)}


def _item(value: tuple[Any, ...]) -> dict[str, Any]:
    if len(value) == 2 and isinstance(value[0], str):
        return {_NAME: value[0], _VALUE: document_of(value[1])}
    return {_NUMBERS: document_of(value)}


def _schema(kind: Any) -> dict[str, Any]:
    if get_origin(kind) in (Union, UnionType):
        (kind,) = (one for one in get_args(kind) if one is not type(None))
    if get_origin(kind) is tuple:
        return {"type": "array", "items": _item_schema(get_args(kind)[0])}
    if is_dataclass(kind):
        # The modules of the model import each other for type checkers only.
        hints = get_type_hints(kind, localns=vars(messages))
        members = {one.name: _schema(hints[one.name]) for one in fields(kind)}
        return {"type": "object", "properties": members}
    return {"type": next(name for plain, name in _PLAIN.items() if issubclass(kind, plain))}


def _item_schema(kind: Any) -> dict[str, Any]:
    if get_origin(kind) is not tuple:
        return _schema(kind)
    first = get_args(kind)[0]
    if first is str:
        members = {_NAME: _schema(str), _VALUE: _schema(get_args(kind)[1])}
    else:
        members = {_NUMBERS: _schema(kind)}
    return {"type": "object", "properties": members}
