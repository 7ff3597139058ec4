"""Objects that were found once, followed through the frames after."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from planegrasp import _core
from planegrasp.errors import InvalidInputError
from planegrasp.tracking.following import FollowConfig, Follower
from planegrasp.tracking.motion import MotionFilterConfig
from planegrasp.tracking.track import Past, Track, distance, noise, size

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.geometry import RigidTransform
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

    Matrix = NDArray[np.float64]

__all__ = ["Tracker", "TrackerConfig"]

# Frames without a timestamp are taken to come so far apart [s].
_FRAME_TIME = 1.0 / 30.0
# Poses of one object closer than this share of its size are one instance …
_SAME_PLACE = 0.5
# … and two tracks closer than this follow the same one.
_SAME_TRACK = 0.2
# A detection and a track that disagree by more of the size than this, or by more of a turn [rad]:
# the track has slid off.
_SLID_OFF, _TURNED_OFF = 0.05, math.radians(10.0)


@dataclass(frozen=True, slots=True)
class TrackerConfig:
    """Settings of the tracker.

    Attributes:
        follow: when a face counts as seen.
        motion: what is assumed of how objects move.
        patience: how long an object that is not seen is looked for where it should be by now [s].
        max_gap: after a longer gap between frames no track goes on [s].
        memory: how late detections may come [s].
    """

    follow: FollowConfig = field(default_factory=FollowConfig)
    motion: MotionFilterConfig = field(default_factory=MotionFilterConfig)
    patience: float = 0.2
    max_gap: float = 0.5
    memory: float = 1.0

    def __post_init__(self) -> None:
        for name in ("patience", "max_gap", "memory"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise InvalidInputError(f"{name} of the tracker must be > 0 s, got {value}")


class Tracker:
    """Follows objects from frame to frame; what it follows, detections must have found first.

    Poses are predicted with constant velocity, corrected by the grey values of the faces in each
    frame (`Follower`), and filtered (`motion`). Nothing is reported that was not seen in that very
    frame: a hidden object is looked for where it should be for a short while, then given up.

    Tracks live in a fixed frame: the camera's where it stands still, else any for which each
    frame's `T_fixed_camera` is known, for example the robot's base.

    Attributes:
        config: its settings.
        tracks: what is followed, in the order in which it was found.
        time: of the last frame [s], None before the first.
    """

    def __init__(self, config: TrackerConfig | None = None) -> None:
        self.config = config or TrackerConfig()
        self.tracks: tuple[Track, ...] = ()
        self.time: float | None = None
        self._follower = Follower(self.config.follow)
        self._motion = self.config.motion.settings()
        self._pasts: dict[int, Past] = {}
        self._created = 0

    def update(
        self,
        frame: RGBDFrame,
        T_fixed_camera: RigidTransform | None = None,
        *,
        only: Collection[int] | None = None,
    ) -> list[Detection]:
        """Follow all tracks into a frame.

        Timestamps should grow. Where one does not, or much time is missing, all tracks are given
        up: nothing is known of the time in between.

        Args:
            frame: the next one. Without a timestamp it is taken to come 1/30 s after the last.
            T_fixed_camera: pose of the camera in the fixed frame; the identity where None.
            only: numbers of the tracks to spend time on; the others are carried on by their
                velocity, unseen. All where None.

        Returns:
            Those seen in this frame, in the order of the tracks.
        """
        camera = _matrix(T_fixed_camera)
        time = self._begin_frame(frame)
        chosen = [t for t in self.tracks if only is None or t.number in only]
        found = self._followed(chosen, frame, time, camera)
        tracks = [self._seen(track, found.get(track.number), time, camera) for track in self.tracks]
        self._keep([track for track in tracks if not self._is_lost(track, time)])
        return [track.detection for track in self.tracks if track.detection is not None]

    def take(
        self,
        detections: Sequence[Detection],
        time: float,
        T_fixed_camera: RigidTransform | None = None,
    ) -> list[Track]:
        """Take in what a detector found in the last frame, or in one of the near past.

        What is followed already is left alone, unless it was not seen lately or the detection
        shows that its track has slid off: then it begins again there. Everything else is followed
        from the next frame on.

        Args:
            detections: of one frame; those without a pose are ignored.
            time: of that frame [s].
            T_fixed_camera: pose of the camera at that time.

        Returns:
            The tracks that begin there, or begin again.
        """
        camera = _matrix(T_fixed_camera)
        new = []
        for detection in detections:
            if detection.pose is None:
                continue
            T = camera @ detection.pose.T_camera_object.as_matrix()
            known = self._nearest(detection.model, T, time)
            if known is None:
                new.append(self._begin(detection, T, time))
            elif known.missing_since is not None or self._has_slid_off(known, T, time):
                again = replace(known, state=self._first(detection, T, time), missing_since=None)
                self._pasts[known.number].add(time, T)
                self._replace(again)
                new.append(again)
        return new

    def catch_up(
        self,
        tracks: Sequence[Track],
        frames: Iterable[tuple[RGBDFrame, float, RigidTransform | None]],
    ) -> None:
        """Follow new tracks through the frames that came while they were being found.

        What moves fast would be too far from where it was found by the next frame.

        Args:
            tracks: as `take` returned them.
            frames: since theirs, each with its time [s] and T_fixed_camera, the oldest first.
        """
        numbers = {track.number for track in tracks}
        for frame, time, T_fixed_camera in frames:
            camera = _matrix(T_fixed_camera)
            chosen = [t for t in self.tracks if t.number in numbers and t.state.time < time]
            found = self._followed(chosen, frame, time, camera)
            for track in chosen:
                self._replace(self._seen(track, found[track.number], time, camera))

    def forget(self, name: str | None = None) -> None:
        """Stop following an object, or all where None."""
        self._keep([t for t in self.tracks if name is not None and t.name != name])

    def _followed(
        self, tracks: Sequence[Track], frame: RGBDFrame, time: float, T_fixed_camera: Matrix
    ) -> dict[int, Detection | str]:
        """Where tracks are seen in a frame, or why not, by their numbers."""
        T_camera_fixed = np.linalg.inv(T_fixed_camera)
        predicted = [
            (t.model, t.instance, T_camera_fixed @ self._expected(t, time)) for t in tracks
        ]
        followed = self._follower.follow(predicted, frame)
        return {t.number: one for t, one in zip(tracks, followed, strict=True)}

    def _begin_frame(self, frame: RGBDFrame) -> float:
        time = frame.timestamp
        if time is None:
            time = 0.0 if self.time is None else self.time + _FRAME_TIME
        if self.time is not None and not 0.0 <= time - self.time <= self.config.max_gap:
            self._keep([])
        self.time = time
        return time

    def _expected(self, track: Track, time: float) -> Matrix:
        """Where a track should be by a time, in the fixed frame."""
        return track.state.predicted(max(time, track.state.time), self._motion).pose.T_base_object

    def _seen(
        self,
        track: Track,
        found: Detection | str | None,
        time: float,
        T_fixed_camera: Matrix,
    ) -> Track:
        """The track after a frame."""
        if found is None:
            return replace(track, detection=None, reason="no time was spent on it")
        if isinstance(found, str) or found.pose is None:
            missing = time if track.missing_since is None else track.missing_since
            return replace(track, detection=None, reason=str(found), missing_since=missing)
        T = T_fixed_camera @ found.pose.T_camera_object.as_matrix()
        self._pasts[track.number].add(time, T)
        state = None
        if time >= track.state.time:
            state = track.state.measured(time, T, noise(found), self._motion)
        if state is None:
            # Seen, but not where any motion would have led it: its velocity is unknown again.
            state = self._first(found, T, time)
        frames = track.frames + 1
        return replace(
            track,
            state=state,
            seen=time,
            detection=found,
            reason="",
            frames=frames,
            missing_since=None,
        )

    def _is_lost(self, track: Track, time: float) -> bool:
        """Whether it was looked for in vain, or not seen at all, for too long."""
        since = track.missing_since
        in_vain = since is not None and time - since > self.config.patience
        return in_vain or time - track.seen > self.config.memory

    def _first(self, detection: Detection, T: Matrix, time: float) -> _core.MotionState:
        return _core.MotionState.first(time, T, noise(detection), self._motion)

    def _begin(self, detection: Detection, T: Matrix, time: float) -> Track:
        taken = {t.instance for t in self.tracks if t.model is detection.model}
        instance = next(i for i in range(len(taken) + 1) if i not in taken)
        state = self._first(detection, T, time)
        # Found in the newest frame, it is seen there, too.
        seen = replace(detection, instance=instance) if time == self.time else None
        track = Track(self._created, detection.model, instance, state, time, seen)
        self._pasts[track.number] = Past(self.config.memory)
        self._pasts[track.number].add(time, T)
        self._created += 1
        self.tracks = (*self.tracks, track)
        return track

    def _nearest(self, model: ObjectModel, T: Matrix, time: float) -> Track | None:
        """The track of this object that was where a detection saw it."""
        same = (t for t in self.tracks if t.model is model)
        near = [(distance(self._pasts[t.number].at(time), T), t) for t in same]
        least, track = min(near, key=lambda pair: pair[0], default=(math.inf, None))
        return track if least <= _SAME_PLACE * size(model) else None

    def _has_slid_off(self, track: Track, T: Matrix, time: float) -> bool:
        was = self._pasts[track.number].at(time)
        cosine = 0.5 * (float(np.trace(was[:3, :3].T @ T[:3, :3])) - 1.0)
        turned = cosine < math.cos(_TURNED_OFF)
        return turned or distance(was, T) > _SLID_OFF * size(track.model)

    def _replace(self, track: Track) -> None:
        self.tracks = tuple(track if t.number == track.number else t for t in self.tracks)

    def _keep(self, tracks: Sequence[Track]) -> None:
        """Go on with these; of two that follow one instance with the older."""
        kept: list[Track] = []
        for track in tracks:
            if not any(self._are_one(track, other) for other in kept):
                kept.append(track)
        self._pasts = {track.number: self._pasts[track.number] for track in kept}
        models = {id(track.model) for track in kept}
        for track in self.tracks:
            if id(track.model) not in models:
                self._follower.forget(track.model)
        self.tracks = tuple(kept)

    def _are_one(self, a: Track, b: Track) -> bool:
        if a.model is not b.model or a.detection is None or b.detection is None:
            return False
        here, there = (self._pasts[t.number].at(max(a.seen, b.seen)) for t in (a, b))
        return distance(here, there) < _SAME_TRACK * size(a.model)


def _matrix(T: RigidTransform | None) -> Matrix:
    """4×4; the identity where None."""
    return np.eye(4) if T is None else T.as_matrix()
