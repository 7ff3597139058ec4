"""A trial run for a reference image: how much of it is recognised in a second, worse view?

The image is turned, shrunk, blurred a little and given a camera's noise; then its features are
matched back. Since the true place of each is known, this counts what a detector will live on:
features that are found again and cannot be confused with another place of the face.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.matching.neighbours import BruteForce

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.features.base import Extractor, Features

__all__ = ["Trial", "run_trial", "shrink"]

# Objects are rarely seen larger than this by a 640×480 camera.
_LONGEST_SIDE = 480
# The second view: rotation, scale, blur [px] and noise [grey levels].
_TURN = np.radians(20.0)
_SHRINK = 0.7
_BLUR = 0.6
_NOISE = 3.0

# Only the strongest features are tried; more say nothing new.
_TRIED = 1500
_NEIGHBOURS = 20
# Two features nearer than this are the same place, a match nearer than that is right [px].
_SAME_PLACE = 10.0
_RIGHT = 3.0
_RATIO = 0.8
# Descriptor distance of right matches where none was right [share of the median distance].
_UNKNOWN_NOISE = 0.25
# Cells of the coverage along each side. Larger ones would count much of the plain face about a
# small texture as covered.
_GRID = 12


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """What the trial found.

    Attributes:
        features: of the reference image, as it is tried.
        scale: size of the tried image over the size of the given one.
        recognised: indices into `features` of those found again, in the right and only place.
        coverage: share of the cells of a 12×12 grid with a recognised feature or between cells
            that have one, 0 … 1.
        repetition: share of the features that look like another place of the face, 0 … 1.
    """

    features: Features
    scale: float
    recognised: NDArray[np.intp]
    coverage: float
    repetition: float


def shrink(gray: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], float]:
    """The image at the size at which a camera will see it at most, and the scale to it."""
    scale = min(1.0, _LONGEST_SIDE / max(gray.shape))
    if scale == 1.0:
        return gray, scale
    size = (max(1, round(gray.shape[1] * scale)), max(1, round(gray.shape[0] * scale)))
    return cv2.resize(gray, size, interpolation=cv2.INTER_AREA).astype(np.uint8), scale


def run_trial(gray: NDArray[np.uint8], extractor: Extractor) -> Trial:
    """Try to recognise an H×W uint8 image in a second view of itself."""
    tried, scale = shrink(gray)
    features = extractor.extract(tried)
    view, view_from_reference = _second_view(tried)
    seen = _strongest(extractor.extract(view))
    if len(features) < 2 or not len(seen):
        return Trial(features, scale, np.zeros(0, np.intp), 0.0, 0.0)

    search = BruteForce(features.descriptors, binary=extractor.is_binary)
    nearest, distance, elsewhere = _nearest_and_elsewhere(search, features.points, seen)
    A, shift = view_from_reference[:, :2], view_from_reference[:, 2]
    expected = (seen.points - shift) @ np.linalg.inv(A).T
    right = np.linalg.norm(features.points[nearest] - expected, axis=1) < _RIGHT
    right &= distance < _RATIO * elsewhere
    recognised = np.unique(nearest[right])

    noise = np.median(distance[right]) if right.any() else _UNKNOWN_NOISE * np.median(distance)
    repetition = _repetition(search, features, float(noise))
    coverage = _coverage(features.points[recognised], tried.shape[:2])
    return Trial(features, scale, recognised, coverage, repetition)


def _second_view(gray: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """The worse view, and the 2×3 matrix from pixels of the reference to pixels of the view."""
    rows, columns = gray.shape
    c, s = _SHRINK * np.cos(_TURN), _SHRINK * np.sin(_TURN)
    A = np.array([[c, -s], [s, c]])
    corners = np.array([[0, 0], [columns - 1, 0], [columns - 1, rows - 1], [0, rows - 1]]) @ A.T
    low, extent = corners.min(axis=0), np.ptp(corners, axis=0)
    view_from_reference = np.column_stack([A, -low])
    size = (int(np.ceil(extent[0])) + 1, int(np.ceil(extent[1])) + 1)
    soft = cv2.GaussianBlur(gray, (0, 0), _BLUR)
    view = cv2.warpAffine(soft, view_from_reference, size, borderMode=cv2.BORDER_REPLICATE)
    noisy = view + np.random.default_rng(0).normal(0.0, _NOISE, view.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8), view_from_reference


def _strongest(features: Features) -> Features:
    return features.select(np.argsort(-features.responses, kind="stable")[:_TRIED])


def _nearest_and_elsewhere(
    search: BruteForce, points: NDArray[np.float32], queries: Features
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """Each query's nearest reference, its distance, and the distance of the nearest elsewhere."""
    indices, distances = search.search(queries.descriptors, min(_NEIGHBOURS, len(points)))
    nearest = indices[:, 0].astype(np.intp)
    apart = np.linalg.norm(points[indices] - points[nearest][:, None], axis=2)
    elsewhere = np.where(apart > _SAME_PLACE, distances, np.inf).min(axis=1)
    return nearest, distances[:, 0].astype(np.float64), elsewhere


def _repetition(search: BruteForce, features: Features, noise: float) -> float:
    """Share of features with a twin elsewhere that noise makes look as near as themselves."""
    _, _, elsewhere = _nearest_and_elsewhere(search, features.points, _strongest(features))
    return float(np.mean(elsewhere < noise / _RATIO))


def _coverage(points: NDArray[np.float32], shape: tuple[int, int]) -> float:
    covered = np.zeros((_GRID, _GRID), np.uint8)
    cells = (points * (_GRID / shape[1], _GRID / shape[0])).astype(int).clip(0, _GRID - 1)
    covered[cells[:, 1], cells[:, 0]] = 1
    # Gaps of a cell in a texture are none; beyond its border nothing is gained.
    closed = cv2.morphologyEx(covered, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))
    return float(np.mean(closed))
