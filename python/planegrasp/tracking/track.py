"""One object that is followed, as of one frame."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.pose_filter import FilteredPose

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp import _core
    from planegrasp.detection import Detection
    from planegrasp.objects import ObjectModel

__all__ = ["Past", "Track", "distance", "noise", "size"]


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One object that is followed.

    Attributes:
        number: of the track; no other has it.
        model: the object.
        instance: its number among the tracks of this object: the smallest that was free.
        state: pose and velocity in the fixed frame; `filtered` has them as values.
        seen: when it was seen last [s].
        detection: in the last frame, None where it was not seen there.
        reason: why it was not seen in the last frame; "" where it was.
        frames: how many it was followed through.
        missing_since: when it was first looked for in vain, since it was seen last [s]; None where
            it was not.
    """

    number: int
    model: ObjectModel
    instance: int
    state: _core.MotionState
    seen: float
    detection: Detection | None = None
    reason: str = ""
    frames: int = 0
    missing_since: float | None = None

    @property
    def name(self) -> str:
        """Of the object."""
        return self.model.name

    @property
    def filtered(self) -> FilteredPose:
        """Pose, velocity and their covariance in the fixed frame, smoothed over time."""
        return FilteredPose.of(self.state.pose)

    @property
    def moves(self) -> float:
        """Probability that it moves, 0 … 1."""
        return self.state.moves


class Past:
    """Where a track was in the near past.

    Args:
        memory: how far back it goes [s].
    """

    def __init__(self, memory: float) -> None:
        self._memory = memory
        self._poses: deque[tuple[float, NDArray[np.float64]]] = deque()

    def add(self, time: float, T: NDArray[np.float64]) -> None:
        """Remember a pose (4×4) of a time [s], and forget what is too old by then."""
        self._poses.append((time, T))
        while self._poses[0][0] < time - self._memory:
            self._poses.popleft()

    def at(self, time: float) -> NDArray[np.float64]:
        """The pose (4×4) of the time nearest to this one [s]."""
        return min(self._poses, key=lambda entry: abs(entry[0] - time))[1]


def noise(detection: Detection) -> NDArray[np.float64]:
    """6×6 covariance of what differs from frame to frame."""
    pose = detection.pose
    if pose is not None and pose.noise_covariance is not None:
        return pose.noise_covariance
    # A method that says nothing of its noise: that of three depth look-ups.
    return np.diag([0.005**2] * 3 + [0.05**2] * 3)


def distance(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Between the origins of two poses (4×4) [m]."""
    return float(np.linalg.norm(a[:3, 3] - b[:3, 3]))


def size(model: ObjectModel) -> float:
    """Longest side of the object's largest face [m]."""
    return max(max(face.width, face.height) for face in model.faces)
