"""Objects in a stream of frames: tracked in every one, found beside."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planegrasp.closing import ClosesAtEnd
from planegrasp.geometry import RigidTransform
from planegrasp.live.scheduler import Scheduler
from planegrasp.live.search_thread import SearchThread
from planegrasp.live.task import Task
from planegrasp.stopwatch import StopWatch
from planegrasp.tracking import Tracker, TrackerConfig

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planegrasp.detection import Detection
    from planegrasp.detector import Detector
    from planegrasp.live.search_thread import Found
    from planegrasp.live.task import Skipped
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.tracking import Track

__all__ = ["Live", "LiveConfig", "LiveFrame"]

# New tracks are followed through so many of the frames since they were seen, at most.
_CAUGHT_UP = 8
# Frames that are kept for that: a search does not take longer than so many.
_REMEMBERED = 64


@dataclass(frozen=True, slots=True)
class LiveConfig:
    """Settings of a live system.

    Attributes:
        tracker: of the tracking.
        background: whether detection runs in a thread of its own while frames go by. Without it
            every frame waits for its detection: slower, and the same in every run.
        rest: while nothing wanted is missed, a detector looks on so often [s], for `at_once` of all
            objects at a time, in turn.
        urgent_for: something wanted that is not there is looked for without rest for so long after
            it was seen last, or after the task began [s].
        at_once: so many objects beside those wanted and missing in one pass of the detector.
    """

    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    background: bool = True
    rest: float = 0.5
    urgent_for: float = 60.0
    at_once: int = 8


@dataclass(frozen=True, slots=True, eq=False)
class LiveFrame:
    """What is known after a frame.

    Attributes:
        frame: as the camera gave it.
        detections: of the objects seen in this very frame.
        tracks: what is followed, also where it was not seen in this frame; their `filtered` poses
            and velocities are in the fixed frame.
        new: tracks that began with this frame.
        lost: tracks that ended with it.
        skipped: what there was no time for.
        seconds: that each stage took.
    """

    frame: RGBDFrame
    detections: tuple[Detection, ...]
    tracks: tuple[Track, ...]
    new: tuple[Track, ...]
    lost: tuple[Track, ...]
    skipped: tuple[Skipped, ...]
    seconds: Mapping[str, float]


class Live(ClosesAtEnd):
    """Finds and follows objects in the frames of one camera; a context manager.

    Each frame is tracked in the caller's thread (`process`). Full detection of new and lost objects
    runs beside it, on the newest frame whenever it is done with the one before.

    Args:
        detector: of all objects; nobody else should use it meanwhile.
        task: what matters; all objects of the library by their priorities where None.
        config: settings.

    Attributes:
        passes: how many frames the detector is done with.
    """

    def __init__(
        self, detector: Detector, task: Task | None = None, config: LiveConfig | None = None
    ) -> None:
        self.config = config or LiveConfig()
        self.passes = 0
        self._detector = detector
        self._models = {r.object.name: r.object for r in detector.references}
        self._scheduler = Scheduler(
            list(self._models.values()), self.config.at_once, self.config.urgent_for
        )
        self._tracker = Tracker(self.config.tracker)
        self._search = SearchThread(detector) if self.config.background else None
        self._searched: float | None = None
        # Frames since the oldest one of which a search is to say something.
        self._since: deque[tuple[RGBDFrame, float, RigidTransform]] = deque(maxlen=_REMEMBERED)
        self._offered: list[str] = []
        self._closely = True
        self._unsought: list[Skipped] = []
        self._lock = threading.Lock()
        self._task = Task()
        self.task = task or Task()

    @property
    def task(self) -> Task:
        """What matters. It may be set from any thread, and counts from the next frame on.

        Raises:
            UnknownObjectError: it wants an object that was not taught; the old task stays.
        """
        with self._lock:
            return self._task

    @task.setter
    def task(self, task: Task) -> None:
        task.check(self._models)
        with self._lock:
            self._task = task

    @property
    def names(self) -> tuple[str, ...]:
        """Of all objects that a task may want."""
        return tuple(self._models)

    def process(self, frame: RGBDFrame, T_fixed_camera: RigidTransform | None = None) -> LiveFrame:
        """Follow what is known into a frame, and look for the rest.

        Args:
            frame: the newest of the camera.
            T_fixed_camera: pose of the camera in a frame that stands still, where it moves; tracks
                and their filtered poses are in that frame.

        Raises:
            PlanegraspError: the detector could not work with a frame.
        """
        T_fixed_camera = RigidTransform.identity() if T_fixed_camera is None else T_fixed_camera
        task, watch = self.task, StopWatch()
        before = self._tracker.tracks
        while self._search is not None and (found := self._search.take()) is not None:
            self._take(found)
        numbers, skipped = self._scheduler.to_follow(self._tracker.tracks, task)
        watch.lap("take")
        detections = self._tracker.update(frame, T_fixed_camera, only=numbers)
        watch.lap("track")
        self._scheduler.followed(len(numbers), watch.seconds["track"])
        detections += self._look_for_more(frame, T_fixed_camera, task)
        watch.lap("detect")
        after = self._tracker.tracks
        return LiveFrame(
            frame=frame,
            detections=tuple(detections),
            tracks=after,
            new=_without(after, before),
            lost=_without(before, after),
            skipped=(*skipped, *self._unsought),
            seconds=watch.seconds,
        )

    def close(self) -> None:
        """End the detector's thread."""
        if self._search is not None:
            self._search.close()

    def _take(self, found: Found) -> None:
        """Begin tracks with what a search found, and follow them into the frames since."""
        self.passes += 1
        new = self._tracker.take(found.detections, found.time, found.T_fixed_camera)
        since = [one for one in self._since if one[1] > found.time]
        # Where these are too many, the newest is one of those that are taken.
        self._tracker.catch_up(new, since[:: -1 - len(since) // _CAUGHT_UP][::-1])

    def _look_for_more(
        self, frame: RGBDFrame, T_fixed_camera: RigidTransform, task: Task
    ) -> list[Detection]:
        """Start a search, or do it: then what it found first is returned."""
        time = self._tracker.time
        if time is None:
            return []
        names = self._names_to_find(time, task)
        if self._search is not None:
            if names:
                self._search.offer(frame, time, T_fixed_camera, names, closely=self._closely)
            oldest = self._search.oldest
            self._since.append((frame, time, T_fixed_camera))
            while self._since and (oldest is None or self._since[0][1] <= oldest):
                self._since.popleft()
            return []
        if not names:
            return []
        new = self._tracker.take(self._detector.detect(frame, among=names), time, T_fixed_camera)
        self.passes += 1
        return [track.detection for track in new if track.detection is not None]

    def _names_to_find(self, time: float, task: Task) -> list[str]:
        """What to look for in the newest frame; nothing where no search is due."""
        tracks = self._tracker.tracks
        self._scheduler.saw(tracks, task, time)
        is_urgent = self._scheduler.is_urgent(tracks, task, time)
        rests = self._searched is not None and 0.0 <= time - self._searched < self.config.rest
        if rests and not is_urgent:
            return []
        if self._search is None or not self._search.is_waiting:
            # The frame before was begun.
            self._scheduler.sought(self._offered, closely=self._closely)
        names, self._unsought = self._scheduler.to_find(tracks, task)
        self._searched, self._offered = time, names
        self._closely = self._scheduler.looks_closely(is_urgent=is_urgent)
        return names


def _without(tracks: tuple[Track, ...], others: tuple[Track, ...]) -> tuple[Track, ...]:
    known = {track.number for track in others}
    return tuple(track for track in tracks if track.number not in known)
