"""Estimated against true poses."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import euler_from_rotation, rotation_angle

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from planegrasp.demo.scene import Shot
    from planegrasp.detection import Detection
    from planegrasp.geometry import RigidTransform

# An object that shows at least this share of a side must be found …
VISIBLE_ENOUGH = 0.4
# … in at least this share of those frames, with errors that stay below these.
REQUIRED_RECALL = 0.9
MEDIAN_MM, MEDIAN_DEG = 1.0, 0.3
WORST_MM, WORST_DEG = 10.0, 3.0


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """One object in one frame.

    Attributes:
        name: of the object.
        frame: its name.
        tilt_deg: of the side that is turned most towards the camera.
        visible: share of that side, 0 … 1.
        truth: T_camera_object.
        estimate: T_camera_object, or None where the object was not found.
    """

    name: str
    frame: str
    tilt_deg: float
    visible: float
    truth: RigidTransform
    estimate: RigidTransform | None

    @property
    def translation_mm(self) -> float:
        """Distance of the estimated to the true origin; infinite where not found."""
        if self.estimate is None:
            return float("inf")
        return 1e3 * float(np.linalg.norm(self.estimate.translation - self.truth.translation))

    @property
    def rotation_deg(self) -> float:
        """Angle between the estimated and the true orientation; infinite where not found."""
        if self.estimate is None:
            return float("inf")
        return float(np.degrees(rotation_angle(self.estimate.rotation, self.truth.rotation)))

    def to_dict(self) -> dict[str, object]:
        """Ready for `json.dumps`; keys and units as in the frames' JSON Lines."""
        found = self.estimate is not None
        return {
            "object": self.name,
            "frame": self.frame,
            "tilt_deg": self.tilt_deg,
            "visible": self.visible,
            "truth": _pose_dict(self.truth),
            "estimate": _pose_dict(self.estimate),
            "translation_mm": self.translation_mm if found else None,
            "rotation_deg": self.rotation_deg if found else None,
        }


@dataclass(frozen=True, slots=True)
class ObjectScore:
    """One object over all frames; errors are over the frames in which it was found.

    Attributes:
        name: of the object.
        frames: in which enough of it can be seen.
        found: in how many of these it was found.
        largest_tilt_deg: at which it was found.
        least_visible: share of a side with which it was found.
        median_mm: translation error; infinite where it was never found.
        median_deg: rotation error.
        worst_mm: largest translation error.
        worst_deg: largest rotation error.
    """

    name: str
    frames: int
    found: int
    largest_tilt_deg: float
    least_visible: float
    median_mm: float
    median_deg: float
    worst_mm: float
    worst_deg: float

    @classmethod
    def of(cls, name: str, comparisons: Iterable[Comparison]) -> ObjectScore:
        """Sum up the comparisons of one object."""
        own = [c for c in comparisons if c.name == name]
        due = [c for c in own if c.visible >= VISIBLE_ENOUGH]
        found = [c for c in own if c.estimate is not None]
        millimetres = [c.translation_mm for c in found] or [float("inf")]
        degrees = [c.rotation_deg for c in found] or [float("inf")]
        return cls(
            name=name,
            frames=len(due),
            found=sum(c.estimate is not None for c in due),
            largest_tilt_deg=max((c.tilt_deg for c in found), default=0.0),
            least_visible=min((c.visible for c in found), default=0.0),
            median_mm=median(millimetres),
            median_deg=median(degrees),
            worst_mm=max(millimetres),
            worst_deg=max(degrees),
        )

    @property
    def faults(self) -> tuple[str, ...]:
        """What is worse than it should be, in words; nothing for a good score."""
        faults = []
        if self.found < REQUIRED_RECALL * self.frames:
            faults.append(
                f"{self.name} was found in {self.found} of {self.frames} frames "
                f"(at least {REQUIRED_RECALL:.0%} should be)"
            )
        if not self.found:
            return tuple(faults)
        for what, value, limit, unit in (
            ("median position error", self.median_mm, MEDIAN_MM, " mm"),
            ("median rotation error", self.median_deg, MEDIAN_DEG, "°"),
            ("largest position error", self.worst_mm, WORST_MM, " mm"),
            ("largest rotation error", self.worst_deg, WORST_DEG, "°"),
        ):
            if value > limit:
                faults.append(
                    f"the {what} of {self.name} is {value:.3g}{unit} (at most {limit:g}{unit})"
                )
        return tuple(faults)


def compare(shot: Shot, detections: Sequence[Detection]) -> list[Comparison]:
    """The best supported detection of every object beside its truth."""
    estimates = {d.name: d.T_camera_object for d in reversed(detections)}
    return [
        Comparison(
            name=name,
            frame=shot.frame.name,
            tilt_deg=shot.tilt_deg[name],
            visible=shot.visible[name],
            truth=truth,
            estimate=estimates.get(name),
        )
        for name, truth in shot.truth.items()
    ]


def false_detections(shot: Shot, detections: Sequence[Detection]) -> int:
    """Detections that are no object of the scene: every object is there once."""
    return len(detections) - len({d.name for d in detections} & set(shot.truth))


def _pose_dict(pose: RigidTransform | None) -> dict[str, object] | None:
    if pose is None:
        return None
    return {
        "T_camera_object": pose.as_matrix().tolist(),
        "translation": pose.translation.tolist(),
        "euler": list(euler_from_rotation(pose.rotation)),
    }
