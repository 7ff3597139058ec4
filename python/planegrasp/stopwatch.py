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
        """A stage ends here; the next one begins. A stage may come several times."""
        now = time.perf_counter()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._last
        self._last = now
