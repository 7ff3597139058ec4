"""What a sequence of frames came to, object by object."""

from __future__ import annotations

from dataclasses import dataclass, field
from statistics import fmean, median
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.io.sinks.as_dict import detection_to_dict
from planegrasp.results import ResultSink

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from planegrasp.detection import Detection
    from planegrasp.rgbd import RGBDFrame


@dataclass(slots=True)
class ObjectSummary:
    """One instance of one object over all frames.

    Attributes:
        name: of the object.
        instance: as in `Detection`.
        inliers: number of inliers in each frame in which it was found.
        distances: distance from the camera [m] in each frame in which it has a pose.
        last: the last detection, or None where it was never found.
    """

    name: str
    instance: int
    inliers: list[int] = field(default_factory=list)
    distances: list[float] = field(default_factory=list)
    last: Detection | None = None

    @property
    def frames_found(self) -> int:
        """In how many frames it was found."""
        return len(self.inliers)

    def to_dict(self, frames: int) -> dict[str, Any]:
        """The summary of so many frames, ready for `json.dumps`; nothing found is null."""
        return {
            "name": self.name,
            "instance": self.instance,
            "frames": frames,
            "frames_found": self.frames_found,
            "mean_inliers": fmean(self.inliers) if self.inliers else None,
            "median_distance": median(self.distances) if self.distances else None,
            "last": detection_to_dict(self.last) if self.last else None,
        }


class Summary(ResultSink):
    """Counts.

    Attributes:
        frames: number of frames seen.
    """

    def __init__(self, names: Iterable[str] = ()) -> None:
        """Objects that are named here are listed even when they are never found."""
        self.frames = 0
        self._objects = {(name, 0): ObjectSummary(name, 0) for name in names}

    @property
    def objects(self) -> tuple[ObjectSummary, ...]:
        """One entry an instance, by name of the object and number of the instance."""
        return tuple(self._objects[key] for key in sorted(self._objects))

    def write(self, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Count the detections of one frame."""
        self.frames += 1
        for found in detections:
            key = found.name, found.instance
            entry = self._objects.setdefault(key, ObjectSummary(*key))
            entry.inliers.append(found.inliers)
            entry.last = found
            if found.pose is not None:
                translation = found.pose.T_camera_object.translation
                entry.distances.append(float(np.linalg.norm(translation)))
