"""Objects that were found once, followed through the frames after."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from planegrasp import _core
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform
from planegrasp.pose_filter import FilteredPose
from planegrasp.tracking.following import FollowConfig, Follower
from planegrasp.tracking.motion import MotionFilterConfig

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from planegrasp.detection import Detection
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

__all__ = ["Track", "Tracker", "TrackerConfig"]

# Frames without a timestamp are taken to come so far apart [s].
_FRAME_TIME = 1.0 / 30.0
# Poses of one object closer than this share of its size are one instance.
_SAME_PLACE = 0.5
# A detection and a track that disagree by more of the size than this: the track has slid off.
_SLID_OFF = 0.05


@dataclass(frozen=True, slots=True)
class TrackerConfig:
    """Settings of the tracker.

    Attributes:
        follow: when a face counts as seen.
        motion: what is assumed of how objects move.
        patience: how long an object that is not seen is looked for where it should be by now [s].
        max_gap: after a longer gap between frames no track goes on [s].
        memory: how far back detections may come late [s].
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


@dataclass(slots=True, eq=False)
class Track:
    """One object that is followed.

    Attributes:
        number: of the track; no other has it.
        model: the object.
        instance: its number among the tracks of this object: the smallest that was free.
        state: pose and velocity in the fixed frame.
        detection: of the last frame, None where it was not seen there.
        seen: when it was seen last [s].
        reason: why it was not seen in the last frame; "" where it was.
        frames: in which it was seen.
    """

    number: int
    model: ObjectModel
    instance: int
    state: _core.MotionState
    detection: Detection | None
    seen: float
    reason: str = ""
    frames: int = 0
    _past: list[tuple[float, RigidTransform]] = field(default_factory=list, repr=False)

    @property
    def name(self) -> str:
        """Of the object."""
        return self.model.name

    @property
    def filtered(self) -> FilteredPose:
        """Pose, velocity and their covariance in the fixed frame, smoothed over time."""
        return FilteredPose.of(self.state.pose)

    def pose_at(self, time: float) -> RigidTransform:
        """Pose in the fixed frame at a time of the near past [s], as it was measured about then."""
        near = min(self._past, key=lambda entry: abs(entry[0] - time))
        return near[1]

    def remember(self, time: float, T: RigidTransform, since: float) -> None:
        """Keep where it was, and forget what is older than `since` [s]."""
        self._past.append((time, T))
        while self._past[0][0] < since:
            self._past.pop(0)


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
    """

    def __init__(self, config: TrackerConfig | None = None) -> None:
        self.config = config or TrackerConfig()
        self.tracks: tuple[Track, ...] = ()
        self._follower = Follower(self.config.follow)
        self._motion = self.config.motion.settings()
        self._time: float | None = None
        self._created = 0

    @property
    def time(self) -> float | None:
        """Of the last frame [s], None before the first."""
        return self._time

    def update(
        self,
        frame: RGBDFrame,
        T_fixed_camera: RigidTransform | None = None,
        *,
        only: Iterable[int] | None = None,
    ) -> list[Detection]:
        """Follow all tracks into a frame.

        Timestamps should grow. Where one does not, or much time is missing, all tracks are given
        up: nothing is known of the time in between.

        Args:
            frame: the next one.
            T_fixed_camera: pose of the camera in the fixed frame; the identity where None.
            only: numbers of the tracks to spend time on; the others are carried on by their
                velocity, unseen. All where None.

        Returns:
            Those seen in this frame, in the order of the tracks.
        """
        T_fixed_camera = T_fixed_camera or RigidTransform.identity()
        time = self._next_time(frame)
        chosen = [t for t in self.tracks if only is None or t.number in only]
        T_camera_fixed = T_fixed_camera.inv()
        predicted = [
            (t.model, t.instance, T_camera_fixed * self._expected(t, time)) for t in chosen
        ]
        followed = self._follower.follow(predicted, frame)
        for track in self.tracks:
            track.detection, track.reason = None, "no time was spent on it"
        for track, found in zip(chosen, followed, strict=True):
            if isinstance(found, str):
                track.reason = found
            else:
                self._see(track, found, time, T_fixed_camera)
        self._drop(time)
        return [track.detection for track in self.tracks if track.detection is not None]

    def take(
        self,
        detections: Sequence[Detection],
        time: float,
        T_fixed_camera: RigidTransform | None = None,
    ) -> list[Track]:
        """Take in what a detector found in the last frame, or in one of the near past.

        What is followed already is left alone, unless the detection shows that its track has slid
        off; everything else is followed from the next frame on.

        Args:
            detections: of one frame; those without a pose are ignored.
            time: of that frame [s].
            T_fixed_camera: pose of the camera at that time.

        Returns:
            The new tracks.
        """
        T_fixed_camera = T_fixed_camera or RigidTransform.identity()
        new = []
        for detection in detections:
            if detection.pose is None:
                continue
            T = T_fixed_camera * detection.pose.T_camera_object
            known = self._nearest(detection.model, T, time)
            if known is None:
                new.append(self._begin(detection, T, time))
            elif _distance(known.pose_at(time), T) > _SLID_OFF * _size(known.model):
                self._restart(known, detection, T, time)
        return new

    def forget(self, name: str | None = None) -> None:
        """Stop following an object, or all where None."""
        self.tracks = tuple(t for t in self.tracks if name is not None and t.name != name)

    def _first(self, detection: Detection, T: RigidTransform, time: float) -> _core.MotionState:
        return _core.MotionState.first(time, T.as_matrix(), _noise(detection), self._motion)

    def _expected(self, track: Track, time: float) -> RigidTransform:
        """Where a track should be by a time, in the fixed frame."""
        pose = track.state.predicted(max(time, track.state.time), self._motion).pose
        return RigidTransform(pose.T_base_object, normalize=False)

    def _next_time(self, frame: RGBDFrame) -> float:
        time = frame.timestamp
        if time is None:
            time = 0.0 if self._time is None else self._time + _FRAME_TIME
        if self._time is not None and not 0.0 <= time - self._time <= self.config.max_gap:
            self.tracks = ()
        self._time = time
        return time

    def _see(
        self, track: Track, found: Detection, time: float, T_fixed_camera: RigidTransform
    ) -> None:
        if found.pose is None:
            return
        T = T_fixed_camera * found.pose.T_camera_object
        covariance = _noise(found)
        state = track.state.measured(time, T.as_matrix(), covariance, self._motion)
        if state is None:
            # Seen, but not where any motion would have led it: its velocity is unknown again.
            state = self._first(found, T, time)
        track.state, track.detection, track.reason = state, found, ""
        track.seen = time
        track.frames += 1
        track.remember(time, T, time - self.config.memory)

    def _begin(self, detection: Detection, T: RigidTransform, time: float) -> Track:
        taken = {t.instance for t in self.tracks if t.model is detection.model}
        instance = next(i for i in range(len(taken) + 1) if i not in taken)
        state = self._first(detection, T, time)
        seen = replace(detection, instance=instance)
        track = Track(self._created, detection.model, instance, state, seen, time, frames=1)
        track.remember(time, T, time)
        self._created += 1
        self.tracks = (*self.tracks, track)
        return track

    def _restart(self, track: Track, detection: Detection, T: RigidTransform, time: float) -> None:
        track.state = self._first(detection, T, time)
        track.remember(time, T, time)

    def _nearest(self, model: ObjectModel, T: RigidTransform, time: float) -> Track | None:
        """The track of this object that was where a detection saw it."""
        tracks = [t for t in self.tracks if t.model is model]
        near = min(tracks, key=lambda t: _distance(t.pose_at(time), T), default=None)
        if near is None or _distance(near.pose_at(time), T) > _SAME_PLACE * _size(model):
            return None
        return near

    def _drop(self, time: float) -> None:
        """Give up what was not seen for long, and the younger of two tracks at one place."""
        kept: list[Track] = []
        for track in self.tracks:
            lost = time - track.seen > self.config.patience
            double = any(
                other.model is track.model
                and _distance(other.pose_at(time), track.pose_at(time))
                < 0.5 * _SAME_PLACE * _size(track.model)
                for other in kept
            )
            if not lost and not double:
                kept.append(track)
        models = {id(track.model) for track in kept}
        for track in self.tracks:
            if id(track.model) not in models:
                self._follower.forget(track.model)
        self.tracks = tuple(kept)


def _noise(detection: Detection) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """6×6 covariance of what differs from frame to frame."""
    pose = detection.pose
    if pose is not None and pose.noise_covariance is not None:
        return pose.noise_covariance
    # A method that says nothing of its noise: that of three depth look-ups.
    return np.diag([0.005**2] * 3 + [0.05**2] * 3)


def _distance(a: RigidTransform, b: RigidTransform) -> float:
    return float(np.linalg.norm(a.translation - b.translation))


def _size(model: ObjectModel) -> float:
    """Longest side of the object's largest face [m]."""
    return max(max(face.width, face.height) for face in model.faces)
