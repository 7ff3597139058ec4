"""Times of the stages of a frame."""

from __future__ import annotations

import time


class StopWatch:
    """Seconds spent in each stage.

    Attributes:
        seconds: by the name of the stage, in their order.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, stage: str) -> None:
        """A stage ends here; the next one begins."""
        now = time.perf_counter()
        self.seconds[stage] = now - self._last
        self._last = now
