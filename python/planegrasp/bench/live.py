"""The live system on rendered streams: how fast, how exact, and what it loses and finds again."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.in_process import in_process
from planegrasp.bench.live_run import LiveRun, run_live
from planegrasp.bench.result import BenchResult
from planegrasp.bench.stream import StreamSettings, models, stream
from planegrasp.detector import Detector
from planegrasp.geometry import RigidTransform, Rotation, rotation_angle
from planegrasp.tracking import Tracker

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

# Frames until the filter has settled and workspaces exist.
_WARM_UP = 15


@dataclass(frozen=True, slots=True)
class LiveSettings:
    """How much is measured.

    Attributes:
        seconds: length of each stream.
        streams: number of objects and rate [Hz] of the streams that are played.
        repeats: streams of each kind.
        compared: length of the streams on which tracking and detection are compared [s].
    """

    seconds: float = 15.0
    streams: tuple[tuple[int, int], ...] = ((1, 30), (3, 30), (10, 30), (1, 60), (3, 60), (10, 60))
    repeats: int = 2
    compared: float = 3.0

    @classmethod
    def quick(cls) -> LiveSettings:
        """Under a minute."""
        return cls(seconds=3.0, streams=((1, 30), (10, 30)), repeats=1, compared=1.0)

    @property
    def steps(self) -> int:
        """Number of streams."""
        return len(self.streams) * self.repeats + 2 * _COMPARED


# Streams of each kind, held and still, on which tracking is compared with detection.
_COMPARED = 3


@dataclass(slots=True)
class Compared:
    """Detection in every frame and tracking on the same frames, in one thread.

    Attributes:
        detect: seconds of each detection.
        track: seconds of each frame of tracking.
        poses: T_camera_object of each frame by "detect", "track" and "filtered", and "truth".
    """

    detect: list[float] = field(default_factory=list)
    track: list[float] = field(default_factory=list)
    poses: dict[str, list[RigidTransform]] = field(default_factory=dict)

    def errors(self, method: str) -> NDArray[np.float64]:
        """Rotation [deg] and translation [mm] of each frame against the truth, N×2."""
        pairs = zip(self.poses[method], self.poses["truth"], strict=True)
        return np.array([_between(T, truth) for T, truth in pairs])

    def jitter(self, method: str) -> NDArray[np.float64]:
        """Root mean square of rotation [deg] and translation [mm] about their mean, 2."""
        poses = self.poses[method]
        mean = RigidTransform.from_components(
            np.mean([T.translation for T in poses], axis=0),
            Rotation.concatenate([T.rotation for T in poses]).mean(),
        )
        squares = np.array([_between(T, mean) for T in poses]) ** 2
        return np.asarray(np.sqrt(squares.mean(axis=0)), dtype=np.float64)


def _between(a: RigidTransform, b: RigidTransform) -> tuple[float, float]:
    angle = float(np.degrees(rotation_angle(a.rotation, b.rotation)))
    return angle, 1e3 * float(np.linalg.norm(a.translation - b.translation))


def run(seed: int, settings: LiveSettings, advance: Callable[[], None]) -> BenchResult:
    """Compare tracking with detection, then play streams at their own pace."""
    held = in_process(1, partial(_compare, seed, settings, "handheld"), advance)
    still = in_process(1, partial(_compare, seed, settings, "still"), advance)
    detect = 1e3 * np.median(np.concatenate([one.detect for one in held]))
    track = 1e3 * np.median(np.concatenate([one.track for one in held]))
    figures = {"track.ratio_over_detect": float(detect / track)}
    for method in ("detect", "track", "filtered"):
        errors = np.median(np.concatenate([one.errors(method) for one in held]), axis=0)
        figures[f"{method}.rotation_deg_median"] = float(errors[0])
        figures[f"{method}.translation_mm_median"] = float(errors[1])
    for method in ("track", "filtered"):
        ratios = np.median([one.jitter(method) / one.jitter("detect") for one in still], axis=0)
        figures[f"{method}.rotation_jitter_over_detect"] = float(ratios[0])
        figures[f"{method}.translation_jitter_over_detect"] = float(ratios[1])
    rows: list[dict[str, str | float]] = []
    total, thirty = LiveRun(), LiveRun()
    for objects, rate in settings.streams:
        played = LiveRun()
        for repeat in range(settings.repeats):
            played.add(run_live(_played(seed, repeat, (objects, rate), settings)))
            advance()
        rows.append(_row(objects, rate, played))
        total.add(played)
        if rate == min(r for _, r in settings.streams):
            thirty.add(played)
        if (objects, rate) == (10, 30):
            figures["ten_objects.fps"] = played.processed / played.seconds
            figures["latency_ms_p99"] = float(1e3 * np.quantile(played.latency, 0.99))
    figures["reacquired_within_5_frames"] = thirty.found_again / max(thirty.returns, 1)
    figures["returns"] = float(thirty.returns)
    figures["false_track_frames_max"] = float(max(total.false_frames, default=0))
    figures["seen"] = total.seen / max(total.there, 1)
    return BenchResult(
        bench="live",
        seed=seed,
        settings={
            "seconds": settings.seconds,
            "streams": [list(one) for one in settings.streams],
            "repeats": settings.repeats,
        },
        rows=rows,
        figures=figures,
        notes=(
            f"one object, one thread: tracking {track:.2f} ms a frame, detection {detect:.1f} ms",
            "found again: within five frames of being half visible, after it could not be seen",
        ),
    )


def _played(
    seed: int, repeat: int, kind: tuple[int, int], settings: LiveSettings
) -> StreamSettings:
    objects, rate = kind
    return StreamSettings(
        rate=rate,
        seconds=settings.seconds,
        objects=objects,
        occlusion=True,
        leaving=True,
        seed=1000 * seed + 100 * repeat + objects + rate,
    )


def _row(objects: int, rate: int, run: LiveRun) -> dict[str, str | float]:
    p50, p99 = 1e3 * np.quantile(run.latency, [0.5, 0.99])
    return {
        "objects": objects,
        "rate Hz": rate,
        "frames/s": run.processed / run.seconds,
        "latency p50 ms": float(p50),
        "p99 ms": float(p99),
        "seen": run.seen / max(run.there, 1),
        "rotation deg": float(np.median(run.rotation_deg or [np.nan])),
        "mm": float(np.median(run.translation_mm or [np.nan])),
        "returns": run.returns,
        "found again": run.found_again / run.returns if run.returns else float("nan"),
        "false frames": max(run.false_frames, default=0),
    }


def _compare(
    seed: int, settings: LiveSettings, motion: str, advance: Callable[[], None]
) -> list[Compared]:
    """Detect in every frame, and track one object, in alternation."""
    results = []
    for repeat in range(_COMPARED):
        config = StreamSettings(
            seconds=settings.compared,
            objects=1,
            motion="still" if motion == "still" else "handheld",
            seed=1000 * seed + 500 + repeat,
        )
        results.append(_compare_one(config))
        advance()
    return results


def _compare_one(config: StreamSettings) -> Compared:
    objects = models(config)
    name = objects[0].name
    detector, tracker, result = Detector(objects), Tracker(), Compared()
    for number, one in enumerate(stream(config)):
        begun = time.perf_counter()
        found = detector.detect(one.frame)
        between = time.perf_counter()
        tracked = tracker.update(one.frame)
        ended = time.perf_counter()
        if not tracker.tracks and one.frame.timestamp is not None:
            tracker.take(found, one.frame.timestamp)
        if number < _WARM_UP or not tracked or not found:
            continue
        result.detect.append(between - begun)
        result.track.append(ended - between)
        poses = {
            "detect": found[0].T_camera_object,
            "track": tracked[0].T_camera_object,
            "filtered": tracker.tracks[0].filtered.T_base_object,
            "truth": one.truth[name],
        }
        for method, T in poses.items():
            if T is not None:
                result.poses.setdefault(method, []).append(T)
    return result
