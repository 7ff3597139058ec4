"""How well a face can be recognised: a score from 0 to 100, with reasons in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.rgbd import check_color
from planegrasp.teaching.trial import run_trial, shrink

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from planegrasp.features.base import Extractor

__all__ = ["TeachingQuality", "assess"]

# The paper wants 10 matches; a face with fewer to give in a good view is lost in a real one.
_FEWEST_RECOGNISED = 15
_SMALLEST_COVERAGE = 0.08

# Below (above, for repetition) these a reason is given.
_GOOD_FEATURES = 60
_GOOD_RECOGNISED = 200
_GOOD_COVERAGE = 0.8
_GOOD_REPETITION = 0.05
_GOOD_SHARPNESS = 0.35
_GOOD_CONTRAST = 50.0
_GOOD_SIDE = 120
# With less there is nothing that could be sharp.
_BLANK_CONTRAST = 10.0

# The score grows with the logarithm of the recognised features up to this many.
_PLENTY_RECOGNISED = 600


@dataclass(frozen=True, slots=True, eq=False)
class TeachingQuality:
    """A verdict on one face.

    Attributes:
        score: 0 … 100; photographs full of detail reach 80 and more. Below 30 expect the face to
            be found only when it is near and seen from the front.
        reasons: what keeps the score down, each with its number and what would be good.
        figures: `features`, `recognised` (found again, in the right and only place, in a second
            view), `coverage` and `repetition` (shares 0 … 1), `sharpness` (share of the gradients'
            energy that is fine detail), `contrast` (grey levels between the 2.5th and 97.5th
            percentile), `columns` and `rows` [px].
        usable: whether the face can be taught at all.
    """

    score: int
    reasons: tuple[str, ...]
    figures: Mapping[str, float]
    usable: bool


def assess(face_image: NDArray[np.uint8], extractor: Extractor | None = None) -> TeachingQuality:
    """Judge a face before it is taught.

    Args:
        face_image: H×W×3 uint8 RGB, the face straight on.
        extractor: with which it will be looked for; None is SIFT, for which the score is
            calibrated.

    Raises:
        ImageError: the image is not H×W×3 uint8.
    """
    if extractor is None:
        from planegrasp.features import make_extractor

        extractor = make_extractor("sift")
    gray = cv2.cvtColor(check_color(face_image), cv2.COLOR_RGB2GRAY).astype(np.uint8)
    trial = run_trial(gray, extractor)
    low, high = np.percentile(gray, (2.5, 97.5))
    figures = {
        "features": float(len(trial.features)),
        "recognised": float(len(trial.recognised)),
        "coverage": trial.coverage,
        "repetition": trial.repetition,
        "sharpness": _sharpness(shrink(gray)[0]),
        "contrast": float(high - low),
        "columns": float(gray.shape[1]),
        "rows": float(gray.shape[0]),
    }
    usable = (
        figures["recognised"] >= _FEWEST_RECOGNISED and figures["coverage"] >= _SMALLEST_COVERAGE
    )
    return TeachingQuality(_score(figures), _reasons(figures), figures, usable)


def _score(figures: Mapping[str, float]) -> int:
    """100 for a good face; each figure takes its share away on its own."""
    recognised = np.log(max(figures["recognised"], 1.0) / _FEWEST_RECOGNISED)
    share = _ramp(recognised, 0.0, np.log(_PLENTY_RECOGNISED / _FEWEST_RECOGNISED))
    share *= _ramp(figures["coverage"], 0.0, 0.9)
    share *= 1.0 - 0.5 * _ramp(figures["repetition"], _GOOD_REPETITION, 1.0)
    share *= 0.5 + 0.5 * _ramp(figures["sharpness"], 0.0, _GOOD_SHARPNESS)
    share *= 0.5 + 0.5 * _ramp(figures["contrast"], 0.0, _GOOD_CONTRAST)
    return round(100.0 * share)


def _reasons(figures: Mapping[str, float]) -> tuple[str, ...]:
    reasons = []
    features, recognised = int(figures["features"]), int(figures["recognised"])
    if features == 0:
        reasons.append("no features: there is no texture to recognise the face by")
    elif features < _GOOD_FEATURES:
        reasons.append(f"few features: {features}, at least {_GOOD_FEATURES} are good")
    if features and recognised < _GOOD_RECOGNISED:
        reasons.append(
            f"few distinctive features: {recognised} of {features} are recognised in a second "
            f"view, at least {_FEWEST_RECOGNISED} are needed and {_GOOD_RECOGNISED} are good"
        )
    if figures["repetition"] > _GOOD_REPETITION:
        reasons.append(
            f"repetitive: {figures['repetition']:.0%} of the features look like another place on "
            f"the face, at most {_GOOD_REPETITION:.0%} are good"
        )
    if features and figures["coverage"] < _GOOD_COVERAGE:
        reasons.append(
            f"clustered: recognised features cover {figures['coverage']:.0%} of the face, at least "
            f"{_GOOD_COVERAGE:.0%} are good"
        )
    if figures["sharpness"] < _GOOD_SHARPNESS and figures["contrast"] >= _BLANK_CONTRAST:
        reasons.append(
            f"blurred: {figures['sharpness']:.0%} of the gradients' energy is fine detail, a sharp "
            f"photo has at least {_GOOD_SHARPNESS:.0%}"
        )
    if figures["contrast"] < _GOOD_CONTRAST:
        reasons.append(
            f"low contrast: grey levels span {figures['contrast']:.0f} of 255, at least "
            f"{_GOOD_CONTRAST:.0f} are good"
        )
    if min(figures["columns"], figures["rows"]) < _GOOD_SIDE:
        reasons.append(
            f"low resolution: {figures['columns']:.0f}×{figures['rows']:.0f} pixels, at least "
            f"{_GOOD_SIDE} along the shorter side are good"
        )
    return tuple(reasons)


def _sharpness(gray: NDArray[np.uint8]) -> float:
    """Share of the gradients' energy that a small blur removes, 0 … 1: contrast cancels out."""
    before = _gradient_energy(gray)
    after = _gradient_energy(cv2.GaussianBlur(gray.astype(np.float32), (0, 0), 1.5))
    return 1.0 - after / before if before > 0 else 0.0


def _gradient_energy(gray: object) -> float:
    image = np.asarray(gray, dtype=np.float32)
    x = cv2.Sobel(image, cv2.CV_32F, 1, 0)
    y = cv2.Sobel(image, cv2.CV_32F, 0, 1)
    return float(np.mean(np.square(x) + np.square(y)))


def _ramp(value: float, low: float, high: float) -> float:
    return float(np.clip((value - low) / (high - low), 0.0, 1.0))
