"""One rendered stream through the live system at its own pace, judged by the truth."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from planegrasp.bench.stream import models, stream
from planegrasp.detector import Detector
from planegrasp.geometry import rotation_angle
from planegrasp.live import Live, prompt

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.bench.stream import StreamFrame, StreamSettings
    from planegrasp.detection import Detection

Verdict = Literal["seen", "false", "unseen"]

# An object is there where at least this share of its face is seen, …
THERE = 0.5
# … and a pose farther from the truth than this share of the face's longer side is one of something
# else.
_ELSEWHERE = 0.25
# So long the system may take at its start [s].
_START = 0.5
# An object that is found again must be seen within so many frames.
WITHIN = 5


@dataclass(slots=True)
class LiveRun:
    """What came of one stream, or of several.

    Attributes:
        seconds: that the streams took.
        frames: that they had.
        processed: those that were not dropped because the one before took too long.
        latency: from the camera to the result, of each processed frame [s].
        there: frames of objects that were there, after the start.
        seen: those of them in which they were seen.
        rotation_deg: error of each pose of an object that was there.
        translation_mm: likewise.
        returns: number of times that an object came back.
        found_again: those of them in which it was seen within five frames.
        false_frames: of each false track its length: frames in a row in which an object was
            reported that was not there, or somewhere else.
    """

    seconds: float = 0.0
    frames: int = 0
    processed: int = 0
    latency: list[float] = field(default_factory=list)
    there: int = 0
    seen: int = 0
    rotation_deg: list[float] = field(default_factory=list)
    translation_mm: list[float] = field(default_factory=list)
    returns: int = 0
    found_again: int = 0
    false_frames: list[int] = field(default_factory=list)

    def add(self, other: LiveRun) -> None:
        """Count another run in."""
        for name in self.__slots__:
            setattr(self, name, getattr(self, name) + getattr(other, name))


def run_live(config: StreamSettings) -> LiveRun:
    """Render a stream, then play it: a slow system misses frames, as with a camera."""
    objects = models(config)
    # All in memory before the clock starts: rendering takes longer than the time between frames.
    frames = list(stream(config))
    sizes = {m.name: max(m.faces[0].width, m.faces[0].height) for m in objects}
    run = LiveRun(seconds=len(frames) / config.rate, frames=len(frames))
    reported: list[dict[str, Detection] | None] = [None] * len(frames)
    with prompt(), Live(Detector(objects)) as live:
        begun, period, number = time.perf_counter(), 1.0 / config.rate, 0
        while number < len(frames):
            wait = begun + number * period - time.perf_counter()
            if wait > 0:
                time.sleep(wait)
            result = live.process(frames[number].frame)
            elapsed = time.perf_counter() - begun
            run.latency.append(elapsed - number * period)
            run.processed += 1
            reported[number] = {d.name: d for d in result.detections}
            # The newest frame by now; those before it are dropped.
            number = max(number + 1, int(elapsed / period))
    start = round(_START * config.rate)
    for name, size in sizes.items():
        seen = [
            None if found is None else _judged(found.get(name), frame, _ELSEWHERE * size, run)
            for frame, found in zip(frames, reported, strict=True)
        ]
        _count(seen, [frame.visible[name] for frame in frames], start, run)
    return run


def _judged(
    detection: Detection | None, frame: StreamFrame, nearest: float, run: LiveRun
) -> Verdict:
    """Whether an object was seen in a frame, and counts its pose's errors [m] where it was."""
    if detection is None or detection.T_camera_object is None:
        return "unseen"
    T, truth = detection.T_camera_object, frame.truth[detection.name]
    visible = frame.visible[detection.name]
    distance = float(np.linalg.norm(T.translation - truth.translation))
    if visible == 0 or distance > nearest:
        return "false"
    if visible >= THERE:
        run.translation_mm.append(1e3 * distance)
        run.rotation_deg.append(float(np.degrees(rotation_angle(T.rotation, truth.rotation))))
    return "seen"


def _count(
    verdicts: Sequence[Verdict | None], visible: Sequence[float], start: int, run: LiveRun
) -> None:
    """Count what became of one object; None is a frame that was dropped."""
    false = 0
    for number, verdict in enumerate(verdicts):
        if verdict is None:
            continue
        if verdict == "false":
            false += 1
        elif false:
            run.false_frames.append(false)
            false = 0
        if number >= start and visible[number] >= THERE:
            run.there += 1
            run.seen += verdict == "seen"
    if false:
        run.false_frames.append(false)
    for number in _returns(visible, start):
        run.returns += 1
        run.found_again += "seen" in verdicts[number : number + WITHIN + 1]


def _returns(visible: Sequence[float], start: int) -> list[int]:
    """Frames in which an object is there again after it was away, and stays for five frames."""
    returns, away = [], False
    for number, share in enumerate(visible):
        if share == 0.0:
            away = number >= start
        elif away and share >= THERE:
            away = False
            after = visible[number : number + WITHIN + 1]
            if len(after) > WITHIN and min(after) >= THERE:
                returns.append(number)
    return returns
