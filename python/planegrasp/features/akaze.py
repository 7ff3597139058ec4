"""AKAZE (Alcantarilla et al., BMVC 2013) with its M-LDB bit strings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.features._opencv import SMALLEST_SIDE, check_gray, to_features
from planegrasp.features.budget import spread

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.features.base import Features


@dataclass(frozen=True, slots=True)
class AKAZEConfig:
    """Settings of AKAZE.

    Attributes:
        threshold: of the detector's response (OpenCV: 0.001); lower finds more.
        octaves: of the non-linear scale space.
        octave_layers: scales an octave.
        max_features: a budget, spread over the image; 0 = all.
    """

    threshold: float = 1e-4
    octaves: int = 4
    octave_layers: int = 4
    max_features: int = 4000


@dataclass(frozen=True, slots=True)
class AKAZE:
    """OpenCV's AKAZE."""

    config: AKAZEConfig = AKAZEConfig()
    name: str = "akaze"
    is_binary: bool = True
    farthest: float = math.inf

    def extract(self, gray: NDArray[np.uint8]) -> Features:
        """Features of an H×W uint8 image; descriptors are N×61 uint8."""
        image = check_gray(gray)
        empty = np.zeros((0, 61), np.uint8)
        if min(image.shape) < SMALLEST_SIDE:
            return to_features((), None, empty)
        c = self.config
        akaze = cv2.xfeatures2d.AKAZE.create(
            threshold=c.threshold,
            nOctaves=c.octaves,
            nOctaveLayers=c.octave_layers,
            max_points=-1,
        )
        keypoints, descriptors = akaze.detectAndCompute(image, None)
        features = to_features(keypoints, descriptors, empty)
        return spread(features, c.max_features, (image.shape[1], image.shape[0]))
