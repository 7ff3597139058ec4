"""Playing a recording as if its camera were running now."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from threading import Event

    from planegrasp.rgbd import RGBDFrame


def stamped(frames: Iterable[RGBDFrame], frames_per_second: float) -> Iterator[RGBDFrame]:
    """Frames with timestamps: their own, or else their number over the rate."""
    for number, frame in enumerate(frames):
        if frame.timestamp is not None and math.isfinite(frame.timestamp):
            yield frame
        else:
            yield replace(frame, timestamp=number / frames_per_second)


def paced(frames: Iterable[RGBDFrame], stop: Event, longest_pause: float) -> Iterator[RGBDFrame]:
    """Frames at the distances in time of their timestamps, until `stop` is set.

    Args:
        frames: with timestamps [s]; one that goes back follows at once.
        stop: ends every wait.
        longest_pause: longer distances are cut to this [s].
    """
    due = time.monotonic()
    before: float | None = None
    for frame in frames:
        stamp = frame.timestamp or 0.0
        if before is not None:
            due += min(max(stamp - before, 0.0), longest_pause)
        before = stamp
        if stop.wait(max(0.0, due - time.monotonic())):
            return
        yield frame
