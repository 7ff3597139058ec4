"""Time per stage and per frame against OpenCV's parts, in alternation in one process."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench import textures
from planegrasp.bench.in_process import in_process
from planegrasp.bench.opencv_pipeline import OpenCVPipeline
from planegrasp.bench.result import BenchResult
from planegrasp.bench.scenes import CORNER_TOLERANCE, corner_error, photograph, view
from planegrasp.detector import Detector
from planegrasp.features import make_extractor

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from planegrasp.simulation import Rendering

STAGES = ("extract", "match", "homography", "pose", "frame")
# Views before the measurement: workspaces, caches and the processor's clock settle.
_WARM_UP = 3


@dataclass(frozen=True, slots=True)
class SpeedSettings:
    """How much is measured.

    Attributes:
        frames: views a photograph.
        max_tilt_deg: views are turned out of plane by up to this.
        photographs: names in `textures.OBJECTS`.
        threads: numbers of threads; 0 = all.
    """

    frames: int = 25
    max_tilt_deg: float = 60.0
    photographs: tuple[str, ...] = textures.WELL_TEXTURED
    threads: tuple[int, ...] = (1, 0)

    @classmethod
    def quick(cls) -> SpeedSettings:
        """Under a minute."""
        return cls(frames=4)

    @property
    def steps(self) -> int:
        """Number of measured frames."""
        return len(self.threads) * len(self.photographs) * self.frames


@dataclass(slots=True)
class Times:
    """What one of the two took and found.

    Attributes:
        seconds: by stage, one number a frame.
        keypoints: of each frame.
        found: whether the face was found within 5 px.
    """

    seconds: dict[str, list[float]] = field(default_factory=lambda: {s: [] for s in STAGES})
    keypoints: list[int] = field(default_factory=list)
    found: list[bool] = field(default_factory=list)

    def add(self, stages: Mapping[str, float], total: float, keypoints: int, found: bool) -> None:
        """Add a frame."""
        for stage, seconds in {**stages, "frame": total}.items():
            self.seconds[stage].append(seconds)
        self.keypoints.append(keypoints)
        self.found.append(found)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Both on the same frames."""

    ours: Times
    opencv: Times


def run(seed: int, settings: SpeedSettings, advance: Callable[[], None]) -> BenchResult:
    """Measure with each number of threads, each in a process of its own."""
    compared = {
        n: in_process(n, partial(_compare, seed, settings), advance) for n in settings.threads
    }
    rows: list[dict[str, str | float]] = []
    figures: dict[str, float] = {}
    for threads, comparison in compared.items():
        name = "all" if threads == 0 else str(threads)
        suffix = "all_threads" if threads == 0 else f"{threads}_thread"
        for stage in STAGES:
            ours, opencv = (
                1e3 * np.asarray(times.seconds[stage])
                for times in (comparison.ours, comparison.opencv)
            )
            ratio = float(np.median(opencv) / np.median(ours))
            rows.append(
                {
                    "threads": name,
                    "stage": stage,
                    "ours ms": float(np.median(ours)),
                    "ours p99 ms": float(np.percentile(ours, 99)),
                    "OpenCV ms": float(np.median(opencv)),
                    "OpenCV p99 ms": float(np.percentile(opencv, 99)),
                    "OpenCV / ours": ratio,
                }
            )
            figures[f"{stage}.ratio_{suffix}"] = ratio
        figures[f"recall_{suffix}"] = float(np.mean(comparison.ours.found))
        figures[f"opencv_recall_{suffix}"] = float(np.mean(comparison.opencv.found))
        figures[f"keypoints_{suffix}"] = float(np.median(comparison.ours.keypoints))
        figures[f"opencv_keypoints_{suffix}"] = float(np.median(comparison.opencv.keypoints))
    one = next(iter(compared.values()))
    return BenchResult(
        bench="speed",
        seed=seed,
        settings={
            "frames": settings.frames,
            "max_tilt_deg": settings.max_tilt_deg,
            "photographs": list(settings.photographs),
        },
        rows=rows,
        figures=figures,
        notes=(
            f"keypoints: ours {np.median(one.ours.keypoints):.0f}, "
            f"OpenCV {np.median(one.opencv.keypoints):.0f}; recall up to "
            f"{settings.max_tilt_deg:g}°: ours {np.mean(one.ours.found):.1%}, "
            f"OpenCV {np.mean(one.opencv.found):.1%}",
            "OpenCV: its SIFT, FLANN, RANSAC and solvePnP, without oblique views or depth",
        ),
    )


def _compare(seed: int, settings: SpeedSettings, advance: Callable[[], None]) -> Comparison:
    ours, opencv = Times(), Times()
    extractor = make_extractor("opencv-sift")
    for number, name in enumerate(settings.photographs):
        model = photograph(name)
        detector, peer = Detector([model]), OpenCVPipeline(model, extractor)
        for i in range(-_WARM_UP, settings.frames):
            rng = np.random.default_rng([seed, number, i + _WARM_UP])
            tilt = float(np.radians(rng.uniform(0.0, settings.max_tilt_deg)))
            _, rendering = view(model, rng, tilt)
            if i < 0:
                _ours(detector, rendering, Times())
                _opencv(peer, rendering, Times())
                continue
            # Neither always comes first: the frame is in the cache for the second.
            if i % 2:
                _ours(detector, rendering, ours)
                _opencv(peer, rendering, opencv)
            else:
                _opencv(peer, rendering, opencv)
                _ours(detector, rendering, ours)
            advance()
    return Comparison(ours, opencv)


def _ours(detector: Detector, rendering: Rendering, times: Times) -> None:
    start = time.perf_counter()
    report = detector.explain(rendering.frame)
    total = time.perf_counter() - start
    corners = report.detections[0].corners if report.detections else None
    features = int(report.faces[0].figures["features"])
    times.add(report.seconds, total, features, _success(corners, rendering))


def _opencv(peer: OpenCVPipeline, rendering: Rendering, times: Times) -> None:
    start = time.perf_counter()
    result = peer.detect(rendering.frame)
    total = time.perf_counter() - start
    times.add(result.seconds, total, result.keypoints, _success(result.corners, rendering))


def _success(corners: NDArray[np.float64] | None, rendering: Rendering) -> bool:
    truth = rendering.corners[0]
    if corners is None or truth is None:
        return False
    return corner_error(corners, truth) < CORNER_TOLERANCE
