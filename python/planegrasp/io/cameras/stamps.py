"""Timestamps that only grow, made of those that a camera or a recording gives."""

from __future__ import annotations

_LONGEST_INTERVAL = 1.0
"""Frames farther apart [s] are the two sides of a gap, which says nothing about the frame rate."""


class GrowingStamps:
    """Shifts timestamps so that each is later than the one before.

    A stamp that does not follow its predecessor is shifted to one usual interval after it, and
    those that come after it by as much, until the source's own stamps are ahead again. So a clock
    that was set back keeps its pace, and a frame out of order shifts no others.

    Attributes:
        shift: what is added to the source's stamps at present [s].
    """

    def __init__(self, interval: float = 1 / 30) -> None:
        """Begin before the first frame.

        Args:
            interval: between two frames [s], as long as none has been seen.
        """
        self.shift = 0.0
        self._interval = interval
        self._own: float | None = None
        self._last: float | None = None

    def following(self, stamp: float) -> tuple[float, float]:
        """The stamp to use for the next frame.

        Args:
            stamp: the source's own [s].

        Returns:
            The growing stamp [s], and how far the source's own went back [s], 0 where it grew.
        """
        back = 0.0
        if self._own is not None and self._last is not None:
            back = max(0.0, self._own - stamp)
            if stamp > self._last:
                self.shift = 0.0
            elif stamp + self.shift <= self._last:
                self.shift = self._last + self._interval - stamp
            if 0.0 < stamp - self._own < _LONGEST_INTERVAL:
                self._interval = stamp - self._own
        self._own = stamp
        self._last = stamp + self.shift
        return self._last, back
