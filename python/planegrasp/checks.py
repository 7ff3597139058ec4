"""Checks of names and lengths that users give."""

from __future__ import annotations

import math
import re

from planegrasp.errors import InvalidInputError

_NAME = re.compile(r"[A-Za-z0-9_-]([A-Za-z0-9_.-]*[A-Za-z0-9_-])?")
_LONGEST_NAME = 100


def check_name(name: str, what: str = "an object") -> str:
    """Return the name if it can be a folder's name on every system.

    Raises:
        InvalidInputError: for anything but 1 to 100 ASCII letters, digits, '-', '_' and '.', or a
            '.' at the start or the end.
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name) or len(name) > _LONGEST_NAME:
        raise InvalidInputError(
            f"{name!r} cannot be the name of {what}: use 1 to {_LONGEST_NAME} letters (a-z), "
            f"digits, '-', '_' and '.', with no '.' at the start or the end"
        )
    return name


def check_length(value: float, what: str) -> float:
    """Return the length [m] as a float if it is positive and finite, else InvalidInputError."""
    length = float(value)
    if not math.isfinite(length) or length <= 0:
        raise InvalidInputError(f"{what} must be > 0 m and finite, got {value}")
    return length
