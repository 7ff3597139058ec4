"""When and in which frame something holds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from planegrasp.errors import InvalidInputError

_BILLION = 1_000_000_000
_LARGEST_SECONDS = 2**31 - 1  # of ROS's builtin_interfaces/Time


@dataclass(frozen=True, slots=True, order=True)
class Stamp:
    """A point in time in whole nanoseconds since 1970, as ROS has it; 0, 0 where it is not known.

    Frames of planegrasp carry float seconds, which near today's dates are exact to a quarter of a
    microsecond. Where the source gave whole nanoseconds, its `Header` is passed on instead.

    Attributes:
        seconds: 0 … 2³¹ - 1.
        nanoseconds: 0 … 999 999 999, after the seconds.

    Raises:
        InvalidInputError: one of them is out of its range.
    """

    seconds: int = 0
    nanoseconds: int = 0

    def __post_init__(self) -> None:
        if not (0 <= self.seconds <= _LARGEST_SECONDS and 0 <= self.nanoseconds < _BILLION):
            raise InvalidInputError(
                f"a stamp has 0 … {_LARGEST_SECONDS} s and 0 … {_BILLION - 1} ns, "
                f"got {self.seconds} and {self.nanoseconds}"
            )

    @classmethod
    def from_seconds(cls, seconds: float | None) -> Stamp:
        """The nearest stamp; 0, 0 for None.

        Raises:
            InvalidInputError: the seconds are negative, not finite or too many.
        """
        if seconds is None:
            return cls()
        if not math.isfinite(seconds):
            raise InvalidInputError(f"a stamp must be finite, got {seconds}")
        # Exact: a product of floats would lose nanoseconds.
        return cls.from_nanoseconds(round(Fraction(seconds) * _BILLION))

    @classmethod
    def from_nanoseconds(cls, nanoseconds: int) -> Stamp:
        """The stamp so many nanoseconds after 1970.

        Raises:
            InvalidInputError: they are negative or too many.
        """
        return cls(*divmod(nanoseconds, _BILLION))

    @property
    def total_nanoseconds(self) -> int:
        """Since 1970."""
        return self.seconds * _BILLION + self.nanoseconds

    def to_seconds(self) -> float:
        """The nearest float, as frames carry it."""
        return self.total_nanoseconds / _BILLION


@dataclass(frozen=True, slots=True)
class Header:
    """When and in which frame a message holds.

    Attributes:
        stamp: of the image that it was seen in.
        frame_id: of the frame in which its poses are.
    """

    stamp: Stamp
    frame_id: str
