"""Putting together what two streams took at the same instant."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

First = TypeVar("First")
Second = TypeVar("Second")

_FEWEST_KEPT = 4


class FramePairing(Generic[First, Second]):
    """Gives each item of a first stream (colour) with the one of a second (depth) nearest in time.

    An item of the first stream waits until its partner is known, or that none comes, or more items
    of its own stream wait than `patience`. Items come out in the order of the first stream; those
    without a partner come with None.
    """

    def __init__(self, largest_gap: float, patience: int = 1) -> None:
        """Begin without any item.

        Args:
            largest_gap: partners lie no farther apart in time than this [s], half a frame.
            patience: how many items of the first stream may wait.
        """
        self._largest_gap = largest_gap
        self._patience = patience
        self._firsts: deque[tuple[float, First]] = deque()
        self._seconds: deque[tuple[float, Second]] = deque(maxlen=max(_FEWEST_KEPT, patience))

    def first(self, stamp: float, item: First) -> list[tuple[float, First, Second | None]]:
        """Bring an item of the first stream with its timestamp [s].

        Returns:
            What need not wait any longer: timestamp [s], item, and partner or None.
        """
        self._firsts.append((stamp, item))
        return self._ready()

    def second(self, stamp: float, item: Second) -> list[tuple[float, First, Second | None]]:
        """Bring an item of the second stream with its timestamp [s]; returns as `first` does."""
        if self._seconds and stamp < self._seconds[-1][0]:
            self._seconds.clear()  # the clock went back: what is kept is of another time
        self._seconds.append((stamp, item))
        return self._ready()

    def rest(self) -> list[tuple[float, First, Second | None]]:
        """What still waits, at the end of the streams."""
        waiting = [(stamp, item, self._taken_partner(stamp)) for stamp, item in self._firsts]
        self._firsts.clear()
        return waiting

    def _ready(self) -> list[tuple[float, First, Second | None]]:
        ready: list[tuple[float, First, Second | None]] = []
        while self._firsts:
            stamp, item = self._firsts[0]
            if not self._is_decided(stamp) and len(self._firsts) <= self._patience:
                break
            self._firsts.popleft()
            ready.append((stamp, item, self._taken_partner(stamp)))
        return ready

    def _is_decided(self, stamp: float) -> bool:
        """Whether the nearest of the second stream is known: its stamps grow from here on."""
        if not self._seconds:
            return False
        # With one rate for both streams, what is nearer than a quarter of a frame is the nearest.
        surely = self._seconds[-1][0] >= stamp
        return surely or stamp - self._seconds[-1][0] <= self._largest_gap / 2

    def _taken_partner(self, stamp: float) -> Second | None:
        if not self._seconds:
            return None
        nearest = min(self._seconds, key=lambda entry: abs(entry[0] - stamp))
        if abs(nearest[0] - stamp) > self._largest_gap:
            return None
        while self._seconds.popleft() is not nearest:
            pass
        return nearest[1]
