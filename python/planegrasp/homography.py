"""Settings of the homography's estimation and verification, and its use on points.

Estimation (a locally optimised RANSAC with progressive sampling; docs/decisions has the comparison
with others) and verification (can the result be a view of the face at all?) are in the core.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Float64Array = NDArray[np.float64]


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
        aspect_sigma: relative standard deviation of the taught aspect ratio; the smaller, the more
            the estimate is held to a rigid view.
        min_agreement: share of the face's textured cells that look like the reference, at least.
        min_doubtful_tiles: share of the tiles of the face that agree with its reference when their
            grey values are aligned, at least, for a face without inliers; in proportion less with
            more of them, nothing with 60. Few inliers may be chance, and so may many close
            together: they count in proportion to their spread below 30 % of the face. Nothing is
            asked of a face whose agreeing tiles, 30 % of all or more, correlate by 0.9.
    """

    min_matches: int = 10
    max_ratio: float = 0.8
    max_loose_ratio: float = 0.9
    threshold: float = 3.0
    iterations: int = 2000
    min_inliers: int = 8
    min_coverage: float = 0.03
    min_side: float = 8.0
    max_stretch: float = 1.6
    aspect_sigma: float = 0.02
    min_agreement: float = 0.3
    min_doubtful_tiles: float = 0.5

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
        if not 0 < self.aspect_sigma < np.inf:
            raise InvalidInputError(f"need a finite aspect_sigma > 0, got {self.aspect_sigma}")
        if not 0 < self.threshold < np.inf or not self.max_stretch > 1:
            raise InvalidInputError(
                f"need a finite threshold > 0 and max_stretch > 1, got {self.threshold}, "
                f"{self.max_stretch}"
            )


def apply_homography(matrix: Float64Array, points: Float64Array) -> Float64Array:
    """Map N×2 points; points at infinity become infinite."""
    mapped = points @ matrix[:, :2].T + matrix[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(mapped[:, :2] / mapped[:, 2:], dtype=np.float64)


def reference_corners(width: float, height: float) -> Float64Array:
    """Corners of a w×h reference in edge coordinates: top-left, then clockwise."""
    return np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
