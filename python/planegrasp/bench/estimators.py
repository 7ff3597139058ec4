"""Robust homography estimators on this project's own matches: which one `homography` should use."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.bench import textures
from planegrasp.bench.result import BenchResult
from planegrasp.bench.robust import ESTIMATORS, REFINED, installed, refined
from planegrasp.bench.scenes import CORNER_TOLERANCE, corner_error, photograph, view
from planegrasp.detector import DetectorConfig
from planegrasp.features import make_extractor
from planegrasp.features.oblique import ObliqueConfig
from planegrasp.homography import apply_homography, reference_corners
from planegrasp.matching.index import make_index
from planegrasp.references import prepare_face
from planegrasp.search import FaceSearch

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from planegrasp._core import Evidence
    from planegrasp.bench.robust import Estimator
    from planegrasp.features.base import Extractor
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.simulation import Rendering

# Rotations up to the first are what every detector should manage, from the second on they are hard.
MODERATE_DEG, STEEP_DEG = 60, 70


@dataclass(frozen=True, slots=True)
class EstimatorsSettings:
    """How much is measured.

    Attributes:
        frames: views a photograph and tilt.
        tilts_deg: out-of-plane rotations.
        photographs: names in `textures.OBJECTS`.
    """

    frames: int = 20
    tilts_deg: tuple[int, ...] = (0, 15, 30, 45, 60, 70, 75)
    photographs: tuple[str, ...] = textures.OBJECTS

    @classmethod
    def quick(cls) -> EstimatorsSettings:
        """Under a minute: no more than an impression."""
        return cls(frames=2, tilts_deg=(30, 60, 70))

    @property
    def steps(self) -> int:
        """Number of frames that are rendered."""
        return len(self.photographs) * len(self.tilts_deg) * self.frames


@dataclass(frozen=True, slots=True)
class Trial:
    """One estimator on one frame's matches: corner error [px] (infinite without one), seconds."""

    error: float
    seconds: float


class _Matcher:
    """The detector's stages up to the matches, for one object."""

    def __init__(self, model: ObjectModel, extractor: Extractor) -> None:
        self._config = DetectorConfig()
        self._extractor = extractor
        self.reference, features = prepare_face(
            model,
            model.faces[0],
            extractor,
            ObliqueConfig(),
            pruning=self._config.pruning,
            longest_side=self._config.reference_side,
            same_place=self._config.same_place,
        )
        self._index = make_index([features], "", binary=extractor.is_binary)
        self.search = FaceSearch(self._config.homography)
        self.search.add(self.reference, features)

    def evidence(self, frame: RGBDFrame) -> Evidence:
        """The nearest references of the frame's features."""
        gray = cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY).astype(np.uint8)
        features = self._extractor.extract(gray)
        candidates = self._index.look(features, self._config.neighbours).candidates
        return self.search.evidence(candidates, features, frame.camera.undistort(features.points))


def run(seed: int, settings: EstimatorsSettings, advance: Callable[[], None]) -> BenchResult:
    """Give every estimator the same matches, those that pass the ratio test, best first."""
    estimators = {name: e for name, e in ESTIMATORS.items() if installed(name)}
    trials: dict[tuple[str, str], list[Trial]] = {}
    extractor = make_extractor("sift")
    for number, name in enumerate(settings.photographs):
        model = photograph(name)
        matcher = _Matcher(model, extractor)
        for tilt in settings.tilts_deg:
            for i in range(settings.frames):
                rng = np.random.default_rng([seed, number, tilt, i])
                _, rendering = view(model, rng, np.radians(tilt))
                group = group_of(name, tilt)
                if group:
                    for estimator, trial in _compare(matcher, rendering, estimators).items():
                        trials.setdefault((group, estimator), []).append(trial)
                advance()
    return _summarise(seed, settings, trials)


def group_of(photograph: str, tilt_deg: int) -> str:
    """The group that a view is counted in; "" for tilts between the groups."""
    texture = "well-textured" if photograph in textures.WELL_TEXTURED else "weak"
    if tilt_deg <= MODERATE_DEG:
        return f"{texture} ≤ {MODERATE_DEG}°"
    return f"{texture} ≥ {STEEP_DEG}°" if tilt_deg >= STEEP_DEG else ""


def _compare(
    matcher: _Matcher, rendering: Rendering, estimators: Mapping[str, Estimator]
) -> dict[str, Trial]:
    """All estimators on the matches of one frame; nothing where these are no candidate."""
    config = DetectorConfig().homography
    evidence = matcher.evidence(rendering.frame)
    matches = matcher.search.matches(evidence, 0, config.max_ratio)
    truth = rendering.corners[0]
    if truth is None or len(matches) < config.min_matches:
        return {}
    order = np.argsort(matches.ratio, kind="stable")
    source = np.ascontiguousarray(matches.reference_points[order])
    target = np.ascontiguousarray(matches.image_points[order])
    corners = reference_corners(*matcher.reference.size)
    trials = {}
    for name, estimator in estimators.items():
        start = time.perf_counter()
        matrix = estimator(source, target)
        seconds = time.perf_counter() - start
        trials[name] = Trial(_error(matrix, corners, truth), seconds)
    for name, estimator in REFINED.items():
        if not installed(name):
            continue
        start = time.perf_counter()
        matrix = refined(estimator, source, target, matcher.search, evidence)
        seconds = time.perf_counter() - start
        trials[name] = Trial(_error(matrix, corners, truth), seconds)
    return trials


def _error(
    matrix: NDArray[np.float64] | None, corners: NDArray[np.float64], truth: NDArray[np.float64]
) -> float:
    """Mean distance of the four corners [px]; infinite without a homography."""
    if matrix is None or not np.all(np.isfinite(matrix)):
        return float("inf")
    error = corner_error(apply_homography(matrix, corners), truth)
    return error if np.isfinite(error) else float("inf")


def _summarise(
    seed: int,
    settings: EstimatorsSettings,
    trials: Mapping[tuple[str, str], Sequence[Trial]],
) -> BenchResult:
    rows: list[dict[str, str | float]] = []
    figures: dict[str, float] = {}
    for (group, estimator), of_both in sorted(trials.items(), key=lambda item: _rank(*item[0])):
        errors = np.array([t.error for t in of_both])
        success = float(np.mean(errors < CORNER_TOLERANCE))
        median, worst = (float(v) for v in np.percentile(errors, (50, 90), method="lower"))
        milliseconds = 1e3 * float(np.median([t.seconds for t in of_both]))
        rows.append(
            {
                "matches of": group,
                "estimator": estimator,
                "frames": len(of_both),
                "success": success,
                "median px": median,
                "90 % px": worst,
                "ms": milliseconds,
            }
        )
        name = estimator.lower().replace(".", "").replace(" + ", " ").replace(" ", "_")
        key = group.replace(" ", "").replace("≤", "_to_").replace("≥", "_from_").rstrip("°")
        figures |= {
            f"{name}.{key}.success": success,
            f"{name}.{key}.corner_px_median": median,
            f"{name}.{key}.corner_px_p90": worst,
            f"{name}.{key}.ms_median": milliseconds,
        }
    return BenchResult(
        bench="estimators",
        seed=seed,
        settings={
            "frames": settings.frames,
            "tilts_deg": list(settings.tilts_deg),
            "photographs": list(settings.photographs),
        },
        rows=rows,
        figures=figures,
        notes=(
            "success = mean corner error < 5 px; errors and times are over all frames of a group",
            "frames with fewer than ten matches that pass the ratio test are no candidates",
            "+ refine: over all matches that agree, as the detector does",
            *(f"{name} is not installed" for name in ESTIMATORS if not installed(name)),
        ),
    )


def _rank(group: str, estimator: str) -> tuple[int, int]:
    """Well-textured before weak, moderate before steep; estimators as they are listed."""
    names = [*ESTIMATORS, *REFINED]
    return 2 * group.startswith("weak") + ("≥" in group), names.index(estimator)
