"""The live system left running: memory, threads, and a camera that drops out."""

from __future__ import annotations

import resource
import threading
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.result import BenchResult
from planegrasp.bench.stream import StreamSettings, models, stream
from planegrasp.detector import Detector
from planegrasp.errors import CameraLostError
from planegrasp.io.cameras import EventKind, NewestFrame, StreamConfig
from planegrasp.live import Live

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planegrasp.rgbd import RGBDFrame

SETTLED = 0.1
"""Share of the frames until caches, workspaces and the allocator have settled."""


@dataclass(frozen=True, slots=True)
class SoakSettings:
    """How long, and with how many losses.

    Attributes:
        frames: that are tracked; 100 000 are 55 minutes of a camera at 30 Hz.
        losses: how often the camera vanishes and is plugged in again.
        objects: in the stream, 1, 3 or 10.
    """

    frames: int = 100_000
    losses: int = 100
    objects: int = 1

    @classmethod
    def quick(cls) -> SoakSettings:
        """Under a minute."""
        return cls(frames=2_000, losses=5)

    @property
    def steps(self) -> int:
        """Hundreds of frames."""
        return self.frames // 100


class LoopingCamera:
    """Plays a short stream to and fro, faster than a real camera, and vanishes now and then.

    Args:
        frames: of the stream.
        lost_every: so many frames after it was plugged in the camera vanishes.
        losses: how often.
    """

    name = "a stream played to and fro"
    notes: tuple[str, ...] = ()

    def __init__(self, frames: Sequence[RGBDFrame], lost_every: int, losses: int) -> None:
        self._frames = [*frames, *frames[-2:0:-1]]
        self._lost_every, self._losses = lost_every, losses
        self._read = self._since = self._vanished = 0
        self._is_open = False
        self.wanted = threading.Event()

    def open(self) -> None:
        """Found at the second try after it vanished."""
        if self._vanished % 2:
            self._vanished += 1
            raise CameraLostError(f"{self.name} is not plugged in")
        self._is_open = True

    def read(self) -> RGBDFrame:
        """The next frame, as soon as one is wanted."""
        if self._since >= self._lost_every and self._vanished < 2 * self._losses:
            self._since = 0
            self._is_open = False
            self._vanished += 1
        if not self._is_open:
            raise CameraLostError(f"{self.name} was unplugged")
        self.wanted.wait(1.0)
        self.wanted.clear()
        frame = self._frames[self._read % len(self._frames)]
        self._read += 1
        self._since += 1
        # By the clock of a camera at 30 Hz, whatever the machine's speed.
        return replace(frame, timestamp=self._read / 30.0)

    def close(self) -> None:
        """Nothing is held."""
        self._is_open = False


def run(seed: int, settings: SoakSettings, advance: Callable[[], None]) -> BenchResult:
    """Track so many frames, and compare the process at the end with how it was."""
    config = StreamSettings(seconds=3.0, objects=settings.objects, seed=seed)
    objects = models(config)
    frames = [one.frame for one in stream(config)]
    camera = LoopingCamera(frames, settings.frames // (settings.losses + 1), settings.losses)
    began = time.monotonic()
    seen = picked_up = lost = 0
    memory, threads = [], []
    # A camera that is back is looked for quickly: hours of waiting measure nothing.
    waiting = StreamConfig(first_retry=0.01, longest_retry=0.02)
    with Live(Detector(objects)) as live, NewestFrame(camera, waiting) as newest:
        for number in range(settings.frames):
            camera.wanted.set()
            frame = newest.next(timeout=10.0)
            if frame is None:
                raise CameraLostError(f"no frame came for 10 s, after {number} frames")
            seen += len(live.process(frame).detections)
            if number % 100 == 99:
                kinds = [event.kind for event in newest.take_events()]
                lost += kinds.count(EventKind.LOST)
                picked_up += kinds.count(EventKind.FOUND)
                if number >= SETTLED * settings.frames:
                    memory.append(resident())
                    threads.append(threading.active_count())
                advance()
    minutes = (time.monotonic() - began) / 60.0
    growth = memory_growth(memory)
    figures = {
        "frames": float(settings.frames),
        "camera_losses": float(lost),
        "cameras_picked_up": float(picked_up),
        "memory_growth_mb": growth,
        "thread_growth": float(threads[-1] - threads[0]),
        "seen": seen / (settings.frames * len(objects)),
    }
    rows = [
        {
            "frames": settings.frames,
            "minutes": minutes,
            "lost": lost,
            "picked up": picked_up,
            "memory MB": memory[-1],
            "growth MB": growth,
            "most MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
            "threads": threads[-1],
            "seen": figures["seen"],
        }
    ]
    return BenchResult(
        bench="soak",
        seed=seed,
        settings={"frames": settings.frames, "losses": settings.losses},
        rows=rows,
        figures=figures,
        notes=("growth: last quarter against the first, after a tenth of the frames",),
    )


def memory_growth(memory: Sequence[float]) -> float:
    """The last quarter of a series against the first, by their medians [MB]."""
    quarter = max(len(memory) // 4, 1)
    return float(np.median(memory[-quarter:]) - np.median(memory[:quarter]))


def resident() -> float:
    """Memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6
