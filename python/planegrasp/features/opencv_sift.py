"""OpenCV's SIFT with RootSIFT descriptors: the peer that `features.sift` is measured against."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.features._opencv import check_gray, to_features
from planegrasp.features.budget import spread

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.features.base import Features


@dataclass(frozen=True, slots=True)
class OpenCVSIFTConfig:
    """Settings of OpenCV's SIFT.

    Attributes:
        max_features: a budget, spread over the image; 0 = all.
        octave_layers: scales an octave (Lowe: 3).
        contrast_threshold: of the extrema, in OpenCV's unit (its default is 0.04). The lower
            value finds faces with weak texture.
        edge_threshold: largest ratio of principal curvatures (Lowe: 10).
        sigma: blur of the first scale [px] (Lowe: 1.6).
        root: take the square root of L1-normalised descriptors (RootSIFT).
    """

    max_features: int = 5000
    octave_layers: int = 3
    contrast_threshold: float = 0.015
    edge_threshold: float = 10.0
    sigma: float = 1.6
    root: bool = True


@dataclass(frozen=True, slots=True)
class OpenCVSIFT:
    """OpenCV's SIFT, without the quarter pixel that its default doubling of the image is off."""

    config: OpenCVSIFTConfig = OpenCVSIFTConfig()
    name: str = "opencv-sift"
    is_binary: bool = False
    farthest: float = math.inf

    def extract(self, gray: NDArray[np.uint8]) -> Features:
        """Features of an H×W uint8 image; descriptors are N×128 float32."""
        c = self.config
        sift = cv2.SIFT.create(
            nfeatures=0,
            nOctaveLayers=c.octave_layers,
            contrastThreshold=c.contrast_threshold,
            edgeThreshold=c.edge_threshold,
            sigma=c.sigma,
            enable_precise_upscale=True,
        )
        keypoints, descriptors = sift.detectAndCompute(check_gray(gray), None)
        features = to_features(keypoints, descriptors, np.zeros((0, 128), np.float32))
        features = spread(features, c.max_features, (gray.shape[1], gray.shape[0]))
        if not c.root:
            return features
        norm = np.maximum(features.descriptors.sum(axis=1, keepdims=True), 1e-9)
        root = np.sqrt(features.descriptors / norm, dtype=np.float32)
        return replace(features, descriptors=root)
