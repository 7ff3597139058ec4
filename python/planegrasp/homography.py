"""From matches to a verified homography of one face (paper, Algorithm 1: RANSAC homography).

Estimation is a locally optimised RANSAC with progressive sampling, in the core; docs/decisions has
the comparison with others. Verification asks whether the result can be a view of the face at all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp import _core
from planegrasp.errors import InvalidInputError
from planegrasp.matching.support import supported

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.matching.index import Candidates, Matches

    Float64Array = NDArray[np.float64]

# Rounds of collecting the matches that agree and fitting to them.
_REFINEMENTS = 2
# Scale of the loss in refinement over the threshold: most inliers are far better than the worst.
_LOSS_SCALE = 0.1


@dataclass(frozen=True, slots=True)
class HomographyConfig:
    """Settings of estimation and verification.

    Attributes:
        min_matches: fewer matches than this are no candidate (paper: 10).
        max_ratio: of the ratio test (Lowe: 0.8).
        max_loose_ratio: of matches that count only where they support each other.
        threshold: largest reprojection error of an inlier [px].
        iterations: at most this many RANSAC samples.
        min_inliers: an accepted face has at least this many.
        min_coverage: convex hull of the inliers over the area of the face, at least.
        min_side: shortest side of the outline [px], at least.
        max_stretch: how far lengths along x and y of the face may disagree with its taught aspect
            ratio, as a factor; also bounds the skew of its axes.
        min_agreement: share of the face's textured cells that look like the reference, at least.
    """

    min_matches: int = 10
    max_ratio: float = 0.8
    max_loose_ratio: float = 0.9
    threshold: float = 3.0
    iterations: int = 5000
    min_inliers: int = 8
    min_coverage: float = 0.03
    min_side: float = 8.0
    max_stretch: float = 1.6
    min_agreement: float = 0.3

    def __post_init__(self) -> None:
        if self.min_matches < 4 or self.min_inliers < 4:
            raise InvalidInputError(
                f"a homography takes at least 4 matches and inliers, got "
                f"min_matches={self.min_matches}, min_inliers={self.min_inliers}"
            )
        if not 0 < self.max_ratio <= self.max_loose_ratio <= 1:
            raise InvalidInputError(
                f"need 0 < max_ratio ≤ max_loose_ratio ≤ 1, got {self.max_ratio}, "
                f"{self.max_loose_ratio}"
            )
        if self.threshold <= 0 or self.max_stretch <= 1:
            raise InvalidInputError(
                f"need threshold > 0 and max_stretch > 1, got {self.threshold}, {self.max_stretch}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class HomographyEstimate:
    """A homography from reference edge coordinates to undistorted pixels, and its inliers."""

    matrix: Float64Array
    inliers: Matches


def hypotheses(
    candidates: Candidates, face: int, config: HomographyConfig
) -> Iterator[HomographyEstimate]:
    """Homographies of one face to be verified, the likelier source first.

    First from the matches that pass the ratio test, sampled in the order of their ratio. Then, for
    faces with few right matches among many, from all those with a weaker ratio that support each
    other, sampled in the order of their support.
    """
    strict = candidates.matches(face, config.max_ratio)
    if len(strict) >= config.min_matches:
        estimate = _estimate(strict, strict.ratio, candidates, face, config)
        if estimate is not None:
            yield estimate
    loose = candidates.matches(face, config.max_loose_ratio)
    if len(loose) >= config.min_matches:
        matches, support = supported(loose)
        if len(matches) >= 4:
            estimate = _estimate(matches, -support, candidates, face, config)
            if estimate is not None:
                yield estimate


def _estimate(
    matches: Matches,
    order: NDArray[np.float64] | NDArray[np.intp],
    candidates: Candidates,
    face: int,
    config: HomographyConfig,
) -> HomographyEstimate | None:
    """Robust homography from matches, those with the smallest `order` sampled first."""
    best_first = np.argsort(order, kind="stable")
    found = _core.estimate_homography(
        matches.reference_points[best_first],
        matches.image_points[best_first],
        threshold=config.threshold,
        max_iterations=config.iterations,
    )
    return None if found is None else refine(found[0], candidates, face, config)


def refine(
    matrix: Float64Array, candidates: Candidates, face: int, config: HomographyConfig
) -> HomographyEstimate | None:
    """Refine a homography over all matches that agree with it.

    Matches that the ratio test refused, but that lie where the first estimate says, take part:
    they make it more precise, and cannot bring a wrong estimate about.

    Returns:
        The estimate, or None where it degenerates or fewer than four matches agree.
    """
    for _ in range(_REFINEMENTS):
        normalised = _normalise(matrix)
        if normalised is None:
            return None
        inliers = _one_per_place(candidates.agreeing(face, normalised, config.threshold))
        if len(inliers) < 4:
            return None
        refined = _core.refine_homography(
            inliers.reference_points,
            inliers.image_points,
            normalised,
            _LOSS_SCALE * config.threshold,
        )
        matrix = normalised if refined is None else refined
    final = _normalise(matrix)
    if final is None:
        return None
    inliers = _one_per_place(candidates.agreeing(face, final, config.threshold))
    return HomographyEstimate(final, inliers)


def apply_homography(matrix: Float64Array, points: Float64Array) -> Float64Array:
    """Map N×2 points; points at infinity become infinite."""
    mapped = points @ matrix[:, :2].T + matrix[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(mapped[:, :2] / mapped[:, 2:], dtype=np.float64)


def reference_corners(width: float, height: float) -> Float64Array:
    """Corners of a w×h reference in edge coordinates: top-left, then clockwise."""
    return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])


def coverage(points: Float64Array, width: float, height: float) -> float:
    """Area of the points' convex hull over the area of the w×h reference, 0 … 1."""
    if len(points) < 3:
        return 0.0
    hull = cv2.convexHull(points.astype(np.float32))
    return float(cv2.contourArea(hull)) / (width * height)


def check_outline(
    matrix: Float64Array, size: tuple[int, int], camera: PinholeCamera, config: HomographyConfig
) -> str:
    """Why the outline cannot be a view of the face; "" where it can.

    Args:
        matrix: reference edge coordinates to undistorted pixels.
        size: width and height of the reference image [px].
        camera: of the frame.
        config: thresholds.
    """
    corners = reference_corners(*size)
    w = corners @ matrix[2, :2] + matrix[2, 2]
    if np.any(w <= 0) and np.any(w >= 0):
        return "part of the face would lie behind the camera"
    outline = apply_homography(matrix, corners)
    sides = np.roll(outline, -1, axis=0) - outline
    turns = sides[:, 0] * np.roll(sides[:, 1], -1) - sides[:, 1] * np.roll(sides[:, 0], -1)
    if np.all(turns < 0):
        return "the outline is mirrored: the face would be seen from behind"
    if not np.all(turns > 0):
        return "the outline is not a convex quadrilateral"
    shortest = float(np.linalg.norm(sides, axis=1).min())
    if shortest < config.min_side:
        return f"the outline is {shortest:.1f} px short (at least {config.min_side:g} px)"
    low, high = outline.min(axis=0), outline.max(axis=0)
    if high[0] < 0 or high[1] < 0 or low[0] > camera.width or low[1] > camera.height:
        return "the outline lies outside of the image"
    return ""


def check_shape(
    matrix: Float64Array,
    face_from_edge: Float64Array,
    camera: PinholeCamera,
    config: HomographyConfig,
) -> tuple[str, float]:
    """Whether the homography is that of a rigid rectangle of the taught aspect ratio.

    K⁻¹·H = λ·[r₁ r₂ t] for a plane: r₁ and r₂ must be equally long and orthogonal.

    Returns:
        Why it is not, "" where it is; and the factor by which it is stretched, ≥ 1.
    """
    metric = np.linalg.inv(camera.matrix) @ matrix @ np.linalg.inv(face_from_edge)
    # The singular values of (r₁ r₂) are equal for a rigid motion; their ratio has both faults.
    values = np.linalg.svd(metric[:, :2], compute_uv=False)
    stretch = float(values[0] / max(values[1], 1e-12))
    if stretch > config.max_stretch:
        return (
            f"no rigid view of a face of this width and height: stretched by {stretch:.2f} "
            f"(at most {config.max_stretch:g})",
            stretch,
        )
    return "", stretch


def _normalise(matrix: Float64Array) -> Float64Array | None:
    """Scale to H[2, 2] = 1, so that w > 0 in front of the camera; None where degenerate.

    H[2, 2] is w at the reference's corner (0, 0), which every acceptable view has in front.
    """
    if not np.all(np.isfinite(matrix)) or abs(matrix[2, 2]) < 1e-12:
        return None
    return np.asarray(matrix / matrix[2, 2], dtype=np.float64)


def _one_per_place(matches: Matches) -> Matches:
    """Drop repeats of a keypoint that was described more than once (several orientations)."""
    quarter_pixels = np.rint(matches.image_points * 4).astype(np.int64)
    order = np.argsort(matches.ratio, kind="stable")
    _, first = np.unique(quarter_pixels[order], axis=0, return_index=True)
    return matches.select(np.sort(order[first]))
