"""Recall and pose error on a recorded sequence with ground truth."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.bench.result import BenchResult
from planegrasp.bench.scene_lens import calibrate_lens
from planegrasp.bench.scene_motion import camera_motion, landmarks, reproject, sightings
from planegrasp.detector import Detector
from planegrasp.errors import PoseError, SourceError
from planegrasp.geometry import RigidTransform, Rotation, rigid_transform, rotation_angle
from planegrasp.grouping import observe
from planegrasp.io.sources import open_source
from planegrasp.objects import ObjectModel, PlanarFace
from planegrasp.pose import make_pose_estimator

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.geometry import PinholeCamera
    from planegrasp.rgbd import RGBDFrame

# A detection counts as found within these of the truth; see docs/benchmarks.md for why not pixels.
FOUND_DEG = 10.0
FOUND_M = 0.05


@dataclass(frozen=True, slots=True)
class RecordedSettings:
    """What is measured.

    Attributes:
        data: folder with color/, depth/, camera.json and ground_truth.json.
        max_frames: at most so many frames; 0 = all.
        calibrate: take the lens distortion from the scene where the camera file has none.
    """

    data: Path
    max_frames: int = 0
    calibrate: bool = False

    @classmethod
    def quick(cls, data: Path) -> RecordedSettings:
        """Under a minute."""
        return cls(data, max_frames=12)

    @property
    def steps(self) -> int:
        """Number of frames in which the objects are looked for."""
        frames = len(_Truth.read(self.data).T_camera_object) - 1
        return min(frames, self.max_frames) if self.max_frames else frames


@dataclass(frozen=True, slots=True, eq=False)
class _Truth:
    """Ground truth: where the object is in each frame, and its faces."""

    T_camera_object: Sequence[RigidTransform]
    faces: dict[str, dict[str, Any]]

    @classmethod
    def read(cls, folder: Path) -> _Truth:
        """The truth as recorded."""
        path = folder / "ground_truth.json"
        try:
            content = json.loads(path.read_text())
            grids = [rigid_transform(T, tolerance=1e-3) for T in content["T_camera_grid"]]
            first = rigid_transform(content["T_camera_cube_in_frame_0"], tolerance=1e-3)
            faces = dict(content["faces"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise SourceError(f"{path}: no ground truth can be read: {error!r}") from error
        return cls([grid * grids[0].inv() * first for grid in grids], faces)

    @property
    def outline(self) -> NDArray[np.float64]:
        """N×2 pixels around the object in the first frame."""
        corners = [face["corners_px_in_frame_0"] for face in self.faces.values()]
        return np.asarray(corners, dtype=np.float64).reshape(-1, 2)

    def in_first_frame(self, camera: PinholeCamera) -> RigidTransform:
        """T_camera_object that puts the corners where they were seen, by this camera.

        For the camera that they were recorded with it is the recorded pose.
        """
        T = self.T_camera_object[0]
        corners = []
        for face in self.faces.values():
            x, y = np.asarray(face["size_m"], dtype=float) / 2
            flat = np.array([[-x, y, 0.0], [x, y, 0.0], [x, -y, 0.0], [-x, -y, 0.0]])
            corners.append(rigid_transform(face["T_cube_face"]).apply(flat))
        points = np.vstack(corners)
        start = (T.rotation.as_rotvec(), T.translation)
        image = camera.undistort(self.outline)
        (rotation, translation), _ = reproject(
            points, image, camera, np.ones(len(points), bool), start
        )
        return RigidTransform.from_components(
            translation.ravel(), Rotation.from_rotvec(rotation.ravel())
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Poses:
    """T_camera_object in one frame: as recorded, and by the camera's motion in the scene."""

    recorded: RigidTransform
    by_scene: RigidTransform | None


@dataclass(frozen=True, slots=True)
class Errors:
    """Of one pose against another; infinite where there is none."""

    rotation_deg: float = np.inf
    translation_mm: float = np.inf

    @classmethod
    def between(cls, pose: RigidTransform | None, other: RigidTransform | None) -> Errors:
        """Angle of the rotation, and distance of the origins."""
        if pose is None or other is None:
            return cls()
        angle = float(np.degrees(rotation_angle(pose.rotation, other.rotation)))
        return cls(angle, 1e3 * float(np.linalg.norm(pose.translation - other.translation)))


@dataclass(frozen=True, slots=True)
class Trial:
    """One object in one frame.

    Attributes:
        recorded: errors against the recorded truth.
        scene: errors against the motion of the camera in the scene.
        three_point_deg: rotation error of the paper's look-ups against the recorded truth.
    """

    recorded: Errors = Errors()
    scene: Errors = Errors()
    three_point_deg: float = np.inf

    @property
    def found(self) -> bool:
        """Whether the pose is that of the object rather than of something else."""
        errors = self.recorded
        return errors.rotation_deg <= FOUND_DEG and errors.translation_mm <= 1e3 * FOUND_M


def run(seed: int, settings: RecordedSettings, advance: Callable[[], None]) -> BenchResult:
    """Teach each face from the first frame, alone and all as one object, and find them again."""
    truth = _Truth.read(settings.data)
    first, *frames = islice(open_source(settings.data), settings.steps + 1)
    seen = landmarks(first, [truth.outline])
    sighted = [sightings(seen, frame) for frame in frames]
    camera = calibrate_lens(seen, sighted, first.camera) if settings.calibrate else first.camera
    first = replace(first, camera=camera)
    T_first_object = truth.in_first_frame(camera)
    alone = [_teach(name, [name], first, truth) for name in truth.faces]
    together = _teach("object", list(truth.faces), first, truth)
    detectors = [Detector(alone), Detector([together])]

    trials: dict[str, list[Trial]] = {model.name: [] for model in [*alone, together]}
    disagreement: list[Errors] = []
    for i, frame in enumerate(frames):
        motion = camera_motion(seen, sighted[i], camera)
        poses = _Poses(
            truth.T_camera_object[i + 1],
            None if motion is None else motion * T_first_object,
        )
        disagreement.append(Errors.between(poses.recorded, poses.by_scene))
        for detector in detectors:
            found = detector.detect(replace(frame, camera=camera))
            for name in {r.object.name for r in detector.references}:
                best = next((d for d in found if d.name == name), None)
                trials[name].append(_trial(best, detector, frame, poses))
        advance()
    return _summarise(seed, settings, camera, trials, disagreement)


def _teach(name: str, faces: Iterable[str], frame: RGBDFrame, truth: _Truth) -> ObjectModel:
    """An object of some of the recorded faces, rectified from their corners in the first frame."""
    taught = []
    for face in faces:
        entry = truth.faces[face]
        width, height = np.asarray(entry["size_m"], dtype=float)
        flat = ObjectModel.from_corners(
            face, frame.color, entry["corners_px_in_frame_0"], width, height, camera=frame.camera
        )
        T_object_face = rigid_transform(entry["T_cube_face"])
        taught.append(PlanarFace(face, flat.faces[0].image, width, height, T_object_face))
    return ObjectModel(name, tuple(taught))


def _trial(
    detection: Detection | None,
    detector: Detector,
    frame: RGBDFrame,
    true: _Poses,
) -> Trial:
    if detection is None or detection.T_camera_object is None:
        return Trial()
    estimate = detection.T_camera_object
    reference = next(
        r
        for r in detector.references
        if r.object.name == detection.name and r.face.name == detection.faces[0].name
    )
    try:
        pose = make_pose_estimator("three_point").estimate(
            [observe(reference, detection.faces[0])], frame
        )
        baseline = Errors.between(pose.T_camera_object, true.recorded).rotation_deg
    except PoseError:
        baseline = np.inf
    return Trial(
        Errors.between(estimate, true.recorded), Errors.between(estimate, true.by_scene), baseline
    )


def _medians(errors: Iterable[Errors]) -> dict[str, float]:
    """Medians over those that are finite; NaN where none is."""
    finite = [e for e in errors if np.isfinite(e.rotation_deg)]
    return {
        "rotation_deg_median": float(np.median([e.rotation_deg for e in finite] or [np.nan])),
        "translation_mm_median": float(np.median([e.translation_mm for e in finite] or [np.nan])),
    }


def _row(trials: Sequence[Trial]) -> dict[str, float]:
    found = [t for t in trials if t.found]
    baseline = [t.three_point_deg for t in trials if np.isfinite(t.three_point_deg)]
    by_scene = _medians(t.scene for t in found)
    return {
        "recall": len(found) / len(trials),
        **_medians(t.recorded for t in found),
        **{f"scene_{figure}": value for figure, value in by_scene.items()},
        "three_point_rotation_deg_median": float(np.median(baseline or [np.nan])),
        "three_point_poses": len(baseline) / len(trials),
    }


def _summarise(
    seed: int,
    settings: RecordedSettings,
    camera: PinholeCamera,
    trials: dict[str, list[Trial]],
    disagreement: Sequence[Errors],
) -> BenchResult:
    rows: list[dict[str, str | float]] = []
    figures: dict[str, float] = {}
    for name, of_face in trials.items():
        row = _row(of_face)
        rows.append({"face": name, "frames": len(of_face), **row})
        figures |= {f"{name}.{figure}": value for figure, value in row.items()}
    figures |= {f"truth.{figure}": value for figure, value in _medians(disagreement).items()}
    return BenchResult(
        bench="recorded",
        seed=seed,
        settings={
            "data": str(settings.data),
            "max_frames": settings.max_frames,
            "calibrate": settings.calibrate,
            "distortion": list(camera.distortion),
        },
        rows=rows,
        figures=figures,
        notes=(
            f"found: within {FOUND_DEG:g}° and {100 * FOUND_M:g} cm of the recorded truth",
            "each face is taught alone from the first frame; 'object' is all of them as one object",
            "scene: against the camera's motion by all that stands still beside the object",
            "truth: the recorded truth against that motion; so much of the errors is its own",
        ),
    )
