"""Putting together what two streams took at the same instant."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

First = TypeVar("First")
Second = TypeVar("Second")

_KEPT = 4
"""Items of the second stream that wait for the first one, which may lag behind."""


class FramePairing(Generic[First, Second]):
    """Gives each item of a first stream (colour) with the one of a second (depth) nearest in time.

    An item waits for its partner until the next one of its own stream comes; then it goes without.
    """

    def __init__(self, largest_gap: float) -> None:
        """Begin without any item.

        Args:
            largest_gap: partners lie no farther apart in time than this [s].
        """
        self._largest_gap = largest_gap
        self._first: tuple[float, First] | None = None
        self._seconds: deque[tuple[float, Second]] = deque(maxlen=_KEPT)

    def first(self, stamp: float, item: First) -> tuple[float, First, Second | None] | None:
        """Bring an item of the first stream with its timestamp [s].

        Returns:
            A timestamp [s], an item and its partner or None, where one can go; else None.
        """
        waiting, self._first = self._first, (stamp, item)
        if waiting is not None:
            return (*waiting, None)
        return self._matched()

    def second(self, stamp: float, item: Second) -> tuple[float, First, Second | None] | None:
        """Bring an item of the second stream with its timestamp [s]; returns as `first` does."""
        self._seconds.append((stamp, item))
        return self._matched()

    def _matched(self) -> tuple[float, First, Second | None] | None:
        if self._first is None or not self._seconds:
            return None
        stamp, item = self._first
        nearest = min(self._seconds, key=lambda entry: abs(entry[0] - stamp))
        if abs(nearest[0] - stamp) > self._largest_gap:
            return None
        self._first = None
        while self._seconds.popleft() is not nearest:
            pass
        return stamp, item, nearest[1]
