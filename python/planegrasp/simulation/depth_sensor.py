"""Noise of structured-light depth sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class KinectV1:
    """A Kinect v1 measures disparity d = f·b/z against its projector, in steps of 1/8 px.

    Sources: the OpenNI/ROS calibration of the device; Khoshelham & Elberink, Sensors 2012.

    Attributes:
        focal_length: of the depth camera [px].
        baseline: between projector and depth camera [m].
        disparity_step: quantisation [px].
        disparity_noise: standard deviation before quantisation [px].
        edge_jump: depth steps larger than this [m] cast a shadow without measurements.
        edge_width: width of that shadow [px].
        range: nearest and farthest depth that is measured [m].
    """

    focal_length: float = 580.0
    baseline: float = 0.075
    disparity_step: float = 0.125
    disparity_noise: float = 0.1
    edge_jump: float = 0.02
    edge_width: int = 3
    range: tuple[float, float] = (0.4, 4.0)

    def measure(
        self, true_depth: NDArray[np.float64], rng: np.random.Generator
    ) -> NDArray[np.float32]:
        """The depth image (metres, 0 = none) that the sensor gives for exact depth (0 = none)."""
        valid = true_depth > 0
        fb = self.focal_length * self.baseline
        disparity = fb / np.where(valid, true_depth, 1.0)
        disparity += rng.normal(0.0, self.disparity_noise, disparity.shape)
        disparity = np.round(disparity / self.disparity_step) * self.disparity_step
        depth = fb / np.maximum(disparity, self.disparity_step)
        valid &= (depth >= self.range[0]) & (depth <= self.range[1])
        valid &= ~self._shadow(true_depth)
        return np.where(valid, depth, 0.0).astype(np.float32)

    def _shadow(self, true_depth: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Pixels within edge_width of a depth discontinuity."""
        depth = true_depth.astype(np.float32)
        kernel = np.ones((3, 3), np.uint8)
        step = cv2.dilate(depth, kernel) - cv2.erode(depth, kernel)
        # A slanted plane also changes from pixel to pixel; a step is what exceeds its slope.
        local_slope = cv2.medianBlur(step, 5)
        edge = (step - local_slope > self.edge_jump).astype(np.uint8)
        size = 2 * (self.edge_width // 2) + 1
        return cv2.dilate(edge, np.ones((size, size), np.uint8)).astype(bool)
