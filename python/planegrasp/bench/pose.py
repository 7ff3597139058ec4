"""Pose error against tilt and distance: ours, the paper's, without depth, and a fiducial marker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench import textures
from planegrasp.bench.marker import marker_pose, marker_rectangle
from planegrasp.bench.occlusion import occluder
from planegrasp.bench.result import BenchResult
from planegrasp.bench.scenes import (
    CAMERA,
    CORNER_TOLERANCE,
    corner_error,
    photograph,
    random_pose,
    rectangles,
)
from planegrasp.bench.textures import random_background
from planegrasp.detector import Detector
from planegrasp.errors import PoseError
from planegrasp.geometry import RigidTransform, rotation_angle
from planegrasp.grouping import observe
from planegrasp.pose import make_pose_estimator
from planegrasp.simulation import render

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.simulation import Rectangle

METHODS = ("three_point", "pnp", "fused")
FACE_WIDTH = 0.2
# The figures are those at this distance [m], over these tilts [deg].
DISTANCE = 0.7
TILTS_DEG = (0, 15, 30, 45)
# Centre of the face, and of the marker, from the centre of the board that carries both [m].
_OFFSET = 0.12
_HIDDEN_SHARE = 0.4


@dataclass(frozen=True, slots=True)
class PoseSettings:
    """How much is measured.

    Attributes:
        frames: for each photograph, tilt and distance.
        tilts_deg: out-of-plane rotations at `DISTANCE`.
        distances: further distances [m], at 30°.
        photographs: names in `textures.OBJECTS`.
    """

    frames: int = 20
    tilts_deg: tuple[int, ...] = (*TILTS_DEG, 60)
    distances: tuple[float, ...] = (0.5, 1.0, 1.5)
    photographs: tuple[str, ...] = textures.WELL_TEXTURED

    @classmethod
    def quick(cls) -> PoseSettings:
        """Under a minute."""
        return cls(frames=2)

    @property
    def conditions(self) -> list[tuple[float, int, bool]]:
        """Distance [m], tilt [deg] and whether the face is partly hidden."""
        clear = [(DISTANCE, t, False) for t in self.tilts_deg]
        clear += [(d, 30, False) for d in self.distances]
        return clear + [(DISTANCE, t, True) for t in TILTS_DEG]

    @property
    def steps(self) -> int:
        """Number of frames that are rendered."""
        return len(self.conditions) * len(self.photographs) * self.frames


@dataclass(frozen=True, slots=True)
class Trial:
    """Errors of one method in one frame; infinite where it gave no pose."""

    rotation_deg: float = np.inf
    translation_mm: float = np.inf

    @property
    def found(self) -> bool:
        """Whether there was a pose."""
        return bool(np.isfinite(self.rotation_deg))


Key = tuple[str, float, int, bool]


def run(seed: int, settings: PoseSettings, advance: Callable[[], None]) -> BenchResult:
    """Measure; `advance` is called after every frame."""
    trials: dict[Key, list[Trial]] = {}
    for number, name in enumerate(settings.photographs):
        model = photograph(name, FACE_WIDTH)
        detector = Detector([model])
        for distance, tilt, hidden in settings.conditions:
            for i in range(settings.frames):
                entropy = [seed, number, round(1000 * distance), tilt, int(hidden), i]
                rng = np.random.default_rng(entropy)
                frame_trials = _frame(
                    rng, model, detector, distance=distance, tilt=np.radians(tilt), hidden=hidden
                )
                for method, trial in frame_trials.items():
                    trials.setdefault((method, distance, tilt, hidden), []).append(trial)
                advance()
    return _summarise(seed, settings, trials)


def _frame(
    rng: np.random.Generator,
    model: ObjectModel,
    detector: Detector,
    *,
    distance: float,
    tilt: float,
    hidden: bool,
) -> dict[str, Trial]:
    """One frame with the face and a marker of the same size side by side on one plane."""
    T_camera_board = random_pose(rng, tilt, distance, offset=(0.03, 0.03))
    side = _OFFSET if rng.random() < 0.5 else -_OFFSET
    T_camera_face = T_camera_board * RigidTransform.from_translation([side, 0.0, 0.0])
    T_camera_marker = T_camera_board * RigidTransform.from_translation([-side, 0.0, 0.0])
    scene: list[Rectangle] = rectangles(model, T_camera_face)
    if hidden:
        scene.append(occluder(scene[0], _HIDDEN_SHARE, rng))
    else:
        scene.append(marker_rectangle(FACE_WIDTH, T_camera_marker))
    rendering = render(scene, CAMERA, rng, background=random_background(rng))
    detections = detector.detect(rendering.frame)
    found = _found(detections, rendering.corners[0])
    trials = {m: _trial(m, found, detector, rendering.frame, T_camera_face) for m in METHODS}
    if not hidden:
        T = marker_pose(rendering.frame, FACE_WIDTH)
        trials["marker"] = _errors(T, T_camera_marker) if T is not None else Trial()
    return trials


def _found(detections: Sequence[Detection], truth: NDArray[np.float64] | None) -> Detection | None:
    if not detections or truth is None:
        return None
    return detections[0] if corner_error(detections[0].corners, truth) < CORNER_TOLERANCE else None


def _trial(
    method: str,
    detection: Detection | None,
    detector: Detector,
    frame: RGBDFrame,
    truth: RigidTransform,
) -> Trial:
    """One method's pose from the same detection."""
    if detection is None:
        return Trial()
    observation = observe(detector.references[0], detection.faces[0])
    try:
        pose = make_pose_estimator(method).estimate([observation], frame)
    except PoseError:
        return Trial()
    return _errors(pose.T_camera_object, truth)


def _errors(estimate: RigidTransform, truth: RigidTransform) -> Trial:
    return Trial(
        float(np.degrees(rotation_angle(estimate.rotation, truth.rotation))),
        1e3 * float(np.linalg.norm(estimate.translation - truth.translation)),
    )


def _summarise(
    seed: int, settings: PoseSettings, trials: Mapping[Key, Sequence[Trial]]
) -> BenchResult:
    rows = []
    for distance, tilt, hidden in settings.conditions:
        for method in (*METHODS, "marker"):
            key = (method, distance, tilt, hidden)
            if key not in trials:
                continue
            rotation, translation, recall = _medians(trials[key])
            rows.append(
                {
                    "distance m": distance,
                    "tilt °": tilt,
                    "hidden": "40 %" if hidden else "",
                    "method": method,
                    "rotation °": rotation,
                    "translation mm": translation,
                    "recall": recall,
                }
            )
    figures: dict[str, float] = {}
    for method in (*METHODS, "marker"):
        pooled = _pool(trials, ((method, DISTANCE, t, False) for t in TILTS_DEG))
        names = ("rotation_deg_median", "translation_mm_median", "recall")
        figures |= {f"{method}.{n}": v for n, v in zip(names, _medians(pooled), strict=True)}
    for what, unit in (("rotation", "deg"), ("translation", "mm")):
        figure = f"{what}_{unit}_median"
        figures[f"fused_over_marker.{what}"] = (
            figures[f"fused.{figure}"] / figures[f"marker.{figure}"]
        )
    hidden_trials = _pool(trials, (("fused", DISTANCE, t, True) for t in TILTS_DEG))
    rotation, translation, recall = _medians(hidden_trials)
    figures |= {
        "occluded.recall": recall,
        "occluded.rotation_deg_median": rotation,
        "occluded.translation_mm_median": translation,
    }
    return BenchResult(
        bench="pose",
        seed=seed,
        settings={"frames": settings.frames, "photographs": list(settings.photographs)},
        rows=rows,
        figures=figures,
        notes=(
            f"face and AprilTag 36h11 are {FACE_WIDTH} m wide, side by side in the same frames",
            f"figures: at {DISTANCE} m over tilts {TILTS_DEG}; medians over frames with a pose",
        ),
    )


def _pool(trials: Mapping[Key, Sequence[Trial]], keys: Iterable[Key]) -> list[Trial]:
    return [trial for key in keys for trial in trials.get(key, ())]


def _medians(trials: Sequence[Trial]) -> tuple[float, float, float]:
    """Median rotation [deg] and translation [mm] error where there is a pose, and recall."""
    found = [t for t in trials if t.found]
    if not found:
        return float("nan"), float("nan"), 0.0
    rotation = float(np.median([t.rotation_deg for t in found]))
    translation = float(np.median([t.translation_mm for t in found]))
    return rotation, translation, len(found) / len(trials)
