"""Recall against out-of-plane rotation per extractor: the paper's Table I, and ε (its eq. 13)."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench import paper, textures
from planegrasp.bench.result import BenchResult
from planegrasp.bench.scenes import CORNER_TOLERANCE, corner_error, photograph, view
from planegrasp.detector import Detector, DetectorConfig
from planegrasp.features.oblique import FRONTAL
from planegrasp.homography import apply_homography, reference_corners

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.geometry import PinholeCamera, RigidTransform
    from planegrasp.objects import PlanarFace
    from planegrasp.simulation import Rendering

    Advance = Callable[[], None]

TILTS_DEG = (0, 10, 20, 30, 40, 45, 50, 55, 60, 65, 70, 75, 80)
RECALL = 0.95
# The corner error's median is over the tilts up to this one [deg], at which most extractors see.
_STEEPEST_OF_MEDIAN = 60

# "sift" is the default; it and "surf" have oblique reference views, "…_plain" are without them.
EXTRACTORS: dict[str, DetectorConfig] = {
    "sift": DetectorConfig(),
    "sift_plain": DetectorConfig(oblique=FRONTAL),
    "surf": DetectorConfig(extractor="surf"),
    "surf_plain": DetectorConfig(extractor="surf", oblique=FRONTAL),
    "akaze": DetectorConfig(extractor="akaze"),
    "brisk": DetectorConfig(extractor="brisk"),
    "orb": DetectorConfig(extractor="orb"),
}


@dataclass(frozen=True, slots=True)
class TiltSettings:
    """How much is measured.

    Attributes:
        frames: views a photograph and tilt.
        tilts_deg: out-of-plane rotations.
        extractors: names in `EXTRACTORS`.
        photographs: names in `textures.OBJECTS`.
    """

    frames: int = 25
    tilts_deg: tuple[int, ...] = TILTS_DEG
    extractors: tuple[str, ...] = tuple(EXTRACTORS)
    photographs: tuple[str, ...] = textures.OBJECTS

    @classmethod
    def quick(cls) -> TiltSettings:
        """Under a minute: no more than an impression."""
        return cls(frames=2, tilts_deg=(0, 45, 60, 70, 75))

    @property
    def steps(self) -> int:
        """Number of frames that are rendered."""
        return len(self.photographs) * len(self.tilts_deg) * self.frames


@dataclass(frozen=True, slots=True)
class Trial:
    """One extractor on one frame.

    Attributes:
        error: mean distance of the corners from the true ones [px], infinite if not found.
        matched_error: the same by the homography from the matches alone.
        epsilon: the paper's ε.
        seconds: of the detection.
    """

    error: float
    matched_error: float
    epsilon: float
    seconds: float


def run(seed: int, settings: TiltSettings, advance: Advance) -> BenchResult:
    """Measure; `advance` is called after every frame."""
    trials: dict[tuple[str, str, int], list[Trial]] = {}
    for number, name in enumerate(settings.photographs):
        model = photograph(name)
        detectors = {e: Detector([model], EXTRACTORS[e]) for e in settings.extractors}
        for tilt in settings.tilts_deg:
            for i in range(settings.frames):
                rng = np.random.default_rng([seed, number, tilt, i])
                T_camera_object, rendering = view(model, rng, np.radians(tilt))
                for extractor, detector in detectors.items():
                    trial = _trial(detector, model.faces[0], rendering, T_camera_object)
                    trials.setdefault((extractor, name, tilt), []).append(trial)
                advance()
    return _summarise(seed, settings, trials)


def _trial(
    detector: Detector, face: PlanarFace, rendering: Rendering, T_camera_face: RigidTransform
) -> Trial:
    start = time.perf_counter()
    detections = detector.detect(rendering.frame)
    seconds = time.perf_counter() - start
    truth = rendering.corners[0]
    if not detections or truth is None:
        return Trial(np.inf, np.inf, np.nan, seconds)
    found, camera = detections[0], rendering.frame.camera
    return Trial(
        corner_error(found.corners, truth),
        corner_error(_matched_corners(found, face, camera), truth),
        epsilon(found, face, camera, T_camera_face),
        seconds,
    )


def _matched_corners(
    detection: Detection, face: PlanarFace, camera: PinholeCamera
) -> NDArray[np.float64]:
    """Where the corners would be without the alignment of grey values, 4×2 pixels."""
    height, width = face.image.shape[:2]
    H = detection.faces[0].matched_homography
    return camera.distort(apply_homography(H, reference_corners(width, height)))


def epsilon(
    detection: Detection, face: PlanarFace, camera: PinholeCamera, T_camera_face: RigidTransform
) -> float:
    """The paper's ε (eq. 13): how far x is from orthogonal to y, a measure of the homography.

    The face's centre, right and top edge midpoints (eq. 3) are mapped into the image by the
    homography and lifted to 3-D with exact depth; x and y are the unit vectors from the centre,
    x' = y × (x × y) is x recalculated, and ε = ‖x' - x‖.
    """
    height, width = face.image.shape[:2]
    points = np.array([[width / 2, height / 2], [width, height / 2], [width / 2, 0.0]])
    mapped = apply_homography(detection.homography, points)
    lifted = _on_plane(camera.distort(mapped), camera, T_camera_face)
    x, y = lifted[1] - lifted[0], lifted[2] - lifted[0]
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    z = np.cross(x, y)
    recalculated = np.cross(y, z / np.linalg.norm(z))
    return float(np.linalg.norm(recalculated - x))


def _on_plane(
    pixels: NDArray[np.float64], camera: PinholeCamera, T_camera_face: RigidTransform
) -> NDArray[np.float64]:
    """Where the rays of pixels meet the plane of the face, camera frame [m]."""
    rays = camera.rays(pixels)
    translation, rotation = T_camera_face.as_components()
    normal = rotation.as_matrix()[:, 2]
    return np.asarray(rays * ((normal @ translation) / (rays @ normal))[:, None], dtype=np.float64)


def _summarise(
    seed: int, settings: TiltSettings, trials: dict[tuple[str, str, int], list[Trial]]
) -> BenchResult:
    groups = {
        "": [n for n in settings.photographs if n in textures.WELL_TEXTURED],
        "weak.": [n for n in settings.photographs if n in textures.WEAK],
    }
    rows: list[dict[str, str | float]] = []
    figures: dict[str, float] = {}
    for extractor in settings.extractors:
        seconds = [t.seconds for key, ts in trials.items() if key[0] == extractor for t in ts]
        for prefix, names in groups.items():
            if not names:
                continue
            recalls = {
                tilt: _recall([t for n in names for t in trials[extractor, n, tilt]])
                for tilt in settings.tilts_deg
            }
            largest = _largest_tilt(recalls)
            figures[f"{extractor}.{prefix}max_tilt_deg"] = largest
            aligned, matched = _corner_medians(
                [t for key, ts in trials.items() if _in_median(key, extractor, names) for t in ts]
            )
            figures[f"{extractor}.{prefix}corner_px_median"] = aligned
            figures[f"{extractor}.{prefix}matched_corner_px_median"] = matched
            row: dict[str, str | float] = {
                "extractor": extractor,
                "photographs": "weak" if prefix else "well-textured",
                "paper max °": paper.MAX_TILT_DEG.get(extractor, "") if not prefix else "",
                "max ° at ≥ 95 %": largest,
                "corner px": aligned,
                "by matches px": matched,
                "ms / frame": 1e3 * float(np.median(seconds)),
            }
            row |= {f"{tilt}°": recalls[tilt] for tilt in settings.tilts_deg}
            rows.append(row)
            if prefix:
                continue
            for tilt in (75, 80):
                if tilt in recalls:
                    figures[f"{extractor}.recall_{tilt}"] = recalls[tilt]
            for tilt in settings.tilts_deg:
                errors = [
                    t.epsilon
                    for n in names
                    for t in trials[extractor, n, tilt]
                    if t.error < CORNER_TOLERANCE
                ]
                figures[f"{extractor}.epsilon_{tilt}"] = (
                    float(np.mean(errors)) if errors else float("nan")
                )
                figures[f"{extractor}.recall_at_{tilt}"] = recalls[tilt]
    return BenchResult(
        bench="tilt",
        seed=seed,
        settings={
            "frames": settings.frames,
            "tilts_deg": list(settings.tilts_deg),
            "photographs": list(settings.photographs),
        },
        rows=rows,
        figures=figures,
        notes=(
            "recall by out-of-plane rotation; success = mean corner error < 5 px",
            "corner px: median error of the found faces at 0-60°; by matches: before the alignment",
            "paper max °: Table I of the paper; its times are of another machine and not shown",
        ),
    )


def _recall(trials: Sequence[Trial]) -> float:
    return float(np.mean([t.error < CORNER_TOLERANCE for t in trials]))


def _in_median(key: tuple[str, str, int], extractor: str, photographs: Sequence[str]) -> bool:
    """Whether the trials of an extractor, a photograph and a tilt count for the corner error."""
    return key[0] == extractor and key[1] in photographs and key[2] <= _STEEPEST_OF_MEDIAN


def _corner_medians(trials: Sequence[Trial]) -> tuple[float, float]:
    """Median corner errors of the faces found: as they are, and by their matches alone [px]."""
    found = [t for t in trials if t.error < CORNER_TOLERANCE]
    if not found:
        return float("nan"), float("nan")
    aligned, matched = np.median([(t.error, t.matched_error) for t in found], axis=0)
    return float(aligned), float(matched)


def _largest_tilt(recalls: dict[int, float]) -> float:
    """The largest tilt up to which recall is high enough at every tilt."""
    largest = 0.0
    for tilt in sorted(recalls):
        if recalls[tilt] < RECALL:
            break
        largest = float(tilt)
    return largest
