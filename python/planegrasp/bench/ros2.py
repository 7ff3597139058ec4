"""ROS 2 over DDS: the latency that it adds, and a listener that is killed again and again."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.result import BenchResult
from planegrasp.bench.ros2_latency import measure_latency
from planegrasp.bench.ros2_restarts import frames_between, publish_on
from planegrasp.bench.ros2_seen import Seen

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Ros2Settings:
    """How long, and against what.

    Attributes:
        frames: that are published while the peer is killed; 10 000 are 5.6 minutes.
        kills: of the peer.
        latency_frames: of which the latency is measured.
        program: of the peer, for example that of `ros2/proof` on RustDDS; None for one in Python.

    Raises:
        InvalidInputError: there are not more frames than kills.
    """

    frames: int = 10_000
    kills: int = 20
    latency_frames: int = 1_000
    program: Path | None = None

    def __post_init__(self) -> None:
        frames_between(self.frames, self.kills)

    @classmethod
    def quick(cls) -> Ros2Settings:
        """Under a minute."""
        return cls(frames=450, kills=3, latency_frames=150)

    @property
    def steps(self) -> int:
        """Tens of frames."""
        return self.latency_frames // 10 + self.frames // 10


def run(seed: int, settings: Ros2Settings, advance: Callable[[], None]) -> BenchResult:
    """Publish on while the peer is killed, then measure the latency."""
    domain = 1 + os.getpid() % 100  # so that two runs at a time do not hear each other
    program = settings.program
    seen = Seen.of(seed)
    frames, kills = settings.frames, settings.kills
    # First what memory is measured of: what the latency takes and gives back would show in it.
    restarts = publish_on(seen, domain, program, frames=frames, kills=kills, advance=advance)
    latency = measure_latency(seen, domain, program, settings.latency_frames, advance)
    again = np.array(restarts.again)
    parts = {
        "added": latency.added,
        "arriving": latency.arriving,
        "leaving": latency.leaving,
        "in process": latency.process,
        "publish": np.array(restarts.publish_ms),
    }
    figures = {
        "added_ms_median": _percentile(latency.added, 50),
        "added_ms_p99": _percentile(latency.added, 99),
        "in_process_ms_median": _percentile(latency.process, 50),
        "lost": float(latency.lost),
        "frames": float(restarts.frames),
        "restarts": float(len(again)),
        "received_again": float(np.isfinite(again).sum()),
        "seconds_to_receive_max": _percentile(again, 100),
        "seconds_to_receive_median": _percentile(again, 50),
        "publish_ms_p99": _percentile(parts["publish"], 99),
        "publish_ms_max": _percentile(parts["publish"], 100),
        "late_ms_max": restarts.late_ms,
        "refused": float(restarts.refused),
        "memory_growth_mb": restarts.growth,
    }
    peer = "Python on Cyclone DDS" if program is None else program.name
    return BenchResult(
        bench="ros2",
        seed=seed,
        settings={"frames": settings.frames, "kills": settings.kills, "peer": peer},
        rows=[
            {
                "ms": name,
                "median": _percentile(times, 50),
                "p90": _percentile(times, 90),
                "p99": _percentile(times, 99),
                "most": _percentile(times, 100),
            }
            for name, times in parts.items()
        ],
        figures=figures,
        notes=(
            f"peer: {peer}; of {len(latency.process)} frames {latency.lost} were not heard of",
            f"{restarts.frames} frames published, {restarts.refused} messages refused, "
            f"memory grew by {restarts.growth:.1f} MB",
            f"peer killed {len(again)}×: received on all topics again after "
            f"{_percentile(again, 50):.2f} s in the median and "
            f"{_percentile(again, 100):.2f} s at most",
        ),
    )


def _percentile(values: NDArray[np.float64], share: float) -> float:
    return float(np.percentile(values, share)) if len(values) else float("nan")
