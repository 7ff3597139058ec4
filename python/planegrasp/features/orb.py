"""ORB (Rublee et al., ICCV 2011)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.features._opencv import SMALLEST_SIDE, check_gray, to_features

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.features.base import Features


@dataclass(frozen=True, slots=True)
class ORBConfig:
    """Settings of ORB.

    Attributes:
        max_features: the strongest are kept.
        scale_factor: between pyramid levels.
        levels: of the pyramid.
        fast_threshold: of the FAST corners [grey levels].
    """

    max_features: int = 3000
    scale_factor: float = 1.2
    levels: int = 8
    fast_threshold: int = 10


@dataclass(frozen=True, slots=True)
class ORB:
    """OpenCV's ORB."""

    config: ORBConfig = ORBConfig()
    name: str = "orb"
    is_binary: bool = True
    farthest: float = math.inf

    def extract(self, gray: NDArray[np.uint8]) -> Features:
        """Features of an H×W uint8 image; descriptors are N×32 uint8."""
        image = check_gray(gray)
        empty = np.zeros((0, 32), np.uint8)
        if min(image.shape) < SMALLEST_SIDE:
            return to_features((), None, empty)
        c = self.config
        orb = cv2.ORB.create(
            nfeatures=c.max_features,
            scaleFactor=c.scale_factor,
            nlevels=c.levels,
            fastThreshold=c.fast_threshold,
        )
        keypoints, descriptors = orb.detectAndCompute(image, None)
        height, width = image.shape
        for keypoint in keypoints:
            # OpenCV scales pixel indices up by the level's nominal scale; what coincides are the
            # images' edges, not their pixel centres, and a level has a whole number of pixels.
            scale = c.scale_factor**keypoint.octave
            x, y = keypoint.pt[0] / scale + 0.5, keypoint.pt[1] / scale + 0.5
            keypoint.pt = (
                x * width / round(width / scale) - 0.5,
                y * height / round(height / scale) - 0.5,
            )
        return to_features(keypoints, descriptors, empty)
