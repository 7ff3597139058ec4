"""How fast a live system is, over the last few seconds."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

__all__ = ["LiveRates", "RateMeter"]


@dataclass(frozen=True, slots=True)
class LiveRates:
    """Figures over a sliding window, and counts since the beginning.

    Attributes:
        camera: frames that came [Hz].
        tracking: frames that were tracked in [Hz].
        passes: of the detector [Hz].
        latency_p50: median time from when a frame was taken up until its poses were there [s].
        latency_p99: the same, in 99 % of the frames no longer [s].
        dropped: frames that came and were not taken up, of all.
    """

    camera: float
    tracking: float
    passes: float
    latency_p50: float
    latency_p99: float
    dropped: int


@dataclass(frozen=True, slots=True)
class _Sample:
    time: float
    latency: float
    read: int
    passes: int


class RateMeter:
    """Keeps what is needed for `LiveRates`.

    Args:
        window: of time [s].
    """

    def __init__(self, window: float = 2.0) -> None:
        self._window = window
        self._samples: deque[_Sample] = deque()

    def add(
        self, time: float, *, latency: float, read: int, dropped: int, passes: int
    ) -> LiveRates:
        """A frame is done.

        Args:
            time: now, by a clock that only grows [s].
            latency: since the frame was taken up [s].
            read: frames that the source gave so far.
            dropped: of these, those that were not taken up.
            passes: of the detector so far.
        """
        samples = self._samples
        samples.append(_Sample(time, latency, read, passes))
        # One before the window is kept: rates are of what came after the first sample.
        while len(samples) > 2 and samples[1].time <= time - self._window:
            samples.popleft()
        first, span = samples[0], time - samples[0].time
        latencies = [sample.latency for sample in samples]
        p50, p99 = np.percentile(latencies, [50, 99]).tolist()
        return LiveRates(
            camera=(read - first.read) / span if span > 0 else 0.0,
            tracking=(len(samples) - 1) / span if span > 0 else 0.0,
            passes=(passes - first.passes) / span if span > 0 else 0.0,
            latency_p50=p50,
            latency_p99=p99,
            dropped=dropped,
        )
