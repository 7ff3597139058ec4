"""Settings of a detector."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError
from planegrasp.features.pruning import PruningConfig
from planegrasp.homography import HomographyConfig

if TYPE_CHECKING:
    from planegrasp.features import Extractor
    from planegrasp.features.oblique import ObliqueConfig
    from planegrasp.pose.base import PoseEstimator

__all__ = ["DetectorConfig"]


@dataclass(frozen=True, slots=True)
class DetectorConfig:
    """Settings of the detector; the defaults are the best all-round choice.

    Attributes:
        extractor: "sift", "surf", "akaze", "brisk", "orb" or "opencv-sift", or an extractor with
            settings of its own, for example `SIFT(SIFTConfig(max_features=2000))`.
        matcher: "native", "flann-kdtree", "flann-kmeans", "flann-lsh" or "brute-force"; "" takes
            native for descriptors of bytes and flann-kdtree for others.
        pose: "fused", "pnp" or "three_point", or an estimator with settings of its own, for example
            `FusedEstimator(FusedConfig(size_sigma=0.0))` where the taught size is exact.
        oblique: the views of each face that are learnt; None makes them for SIFT and SURF.
        pruning: how many descriptors of a face are kept, and how they are chosen.
        first_look: the most useful descriptors of each face that every frame is compared with, of
            more than two faces fewer each (1800 in all or 280 of each, shared out by how weak
            their textures are); the others only where these did not find the face. 0 = all at
            once.
        closer_look: at most so many faces of those that a first look left open are looked at
            closer, those with most matches.
        reference_side: longest side of the reference image that features are taken from [px].
        neighbours: how many nearest descriptors of a feature may turn out to be the right one.
        same_place: points of a face closer than this share of its longest side are one place for
            the ratio test.
        max_instances: at most so many instances of one object in a frame.
        homography: settings of estimation and verification.
    """

    extractor: str | Extractor = "sift"
    matcher: str = ""
    pose: str | PoseEstimator = "fused"
    oblique: ObliqueConfig | None = None
    pruning: PruningConfig = field(default_factory=PruningConfig)
    first_look: int = 800
    closer_look: int = 4
    reference_side: int = 400
    neighbours: int = 6
    same_place: float = 0.03
    max_instances: int = 8
    homography: HomographyConfig = field(default_factory=HomographyConfig)

    def __post_init__(self) -> None:
        if self.reference_side < 32 or self.neighbours < 2 or self.max_instances < 1:
            raise InvalidInputError(
                f"need reference_side ≥ 32, neighbours ≥ 2 and max_instances ≥ 1, got "
                f"{self.reference_side}, {self.neighbours}, {self.max_instances}"
            )
        if self.first_look < 0 or self.closer_look < 0:
            raise InvalidInputError(
                f"first_look and closer_look must be ≥ 0, got {self.first_look}, {self.closer_look}"
            )
