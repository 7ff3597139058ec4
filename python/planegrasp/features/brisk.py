"""FAST corners (Rosten & Drummond, ECCV 2006) described by BRISK (Leutenegger et al., ICCV 2011).

The paper's combination. FAST alone has no scale; it is run on a pyramid here, so that an object
need not be seen at the size of its reference image. `levels=1` is the plain combination.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.features._opencv import check_gray, to_features
from planegrasp.features.budget import spread

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.features.base import Features

# BRISK describes a keypoint of this size [px] at its finest scale.
_BASE_SIZE = 12.0
# FAST needs a circle of radius 3, the BRISK pattern somewhat more.
_SMALLEST_SIDE = 32


@dataclass(frozen=True, slots=True)
class BRISKConfig:
    """Settings of FAST + BRISK.

    Attributes:
        threshold: of the FAST corners [grey levels].
        levels: of the pyramid; 1 = the image only, as in the paper.
        scale_factor: between pyramid levels.
        max_features: a budget, spread over the image; 0 = all.
    """

    threshold: int = 15
    levels: int = 6
    scale_factor: float = 1.4
    max_features: int = 4000


@dataclass(frozen=True, slots=True)
class BRISK:
    """OpenCV's FAST and BRISK."""

    config: BRISKConfig = BRISKConfig()
    name: str = "brisk"
    is_binary: bool = True
    farthest: float = math.inf

    def extract(self, gray: NDArray[np.uint8]) -> Features:
        """Features of an H×W uint8 image; descriptors are N×64 uint8."""
        image = check_gray(gray)
        brisk = cv2.xfeatures2d.BRISK.create()
        keypoints, descriptors = brisk.compute(image, self._corners(image))
        features = to_features(keypoints, descriptors, np.zeros((0, 64), np.uint8))
        return spread(features, self.config.max_features, (image.shape[1], image.shape[0]))

    def _corners(self, image: NDArray[np.uint8]) -> list[cv2.KeyPoint]:
        """FAST corners over the pyramid."""
        c = self.config
        fast = cv2.FastFeatureDetector.create(threshold=c.threshold)
        height, width = image.shape
        corners: list[cv2.KeyPoint] = []
        for level in range(c.levels):
            scale = c.scale_factor**level
            size = (round(width / scale), round(height / scale))
            if min(size) < _SMALLEST_SIDE:
                break
            shrunk = image if level == 0 else cv2.resize(image, size, interpolation=cv2.INTER_AREA)
            sx, sy = width / size[0], height / size[1]
            for corner in fast.detect(shrunk):
                x, y = corner.pt
                # Pixel centres are integers on both levels: edges, not centres, coincide.
                corner.pt = ((x + 0.5) * sx - 0.5, (y + 0.5) * sy - 0.5)
                corner.size = _BASE_SIZE * scale
                corners.append(corner)
        return corners
