"""DDS messages as what JSON can hold, and back."""

from __future__ import annotations

import base64
from dataclasses import fields, is_dataclass
from typing import Any, get_args

import numpy as np

__all__ = ["message_from_json", "message_to_json"]


def message_to_json(message: Any) -> Any:
    """A message as nested dictionaries, lists, numbers and texts; bytes in base64."""
    if is_dataclass(message):
        return {
            field.name: message_to_json(getattr(message, field.name)) for field in fields(message)
        }
    if isinstance(message, bytes | bytearray | memoryview):
        return base64.b64encode(message).decode()
    if isinstance(message, list):
        return [message_to_json(one) for one in message]
    return message


def message_from_json(kind: Any, value: Any) -> Any:
    """The message of a type that `message_to_json` made such values of.

    Numbers that are to be float32 are rounded to it.

    Raises:
        KeyError, TypeError: members are missing, or there are others.
    """
    if is_dataclass(kind):
        return _whole(kind, value)
    _, *about = get_args(kind) or (None,)
    if not about:
        return value
    element = getattr(about[0], "subtype", None)
    if element is None and value is None:
        return float("nan")  # which JSON does not have
    if element is None:
        return float(np.float32(value)) if about[0] == "float32" else value
    if isinstance(value, str):
        return base64.b64decode(value)
    return [message_from_json(element, one) for one in value]


def _whole(kind: Any, value: dict[str, Any]) -> Any:
    types = {field.name: field.type for field in fields(kind)}
    if unknown := set(value) - set(types):
        raise TypeError(f"{kind.__name__} has no {', '.join(sorted(unknown))}")
    return kind(**{name: message_from_json(one, value[name]) for name, one in types.items()})
