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
        edge_jump: at depth steps larger than this [m] measurements fail.
        edge_width: width of the band where they do [px].
        edge_dropout: probability that a pixel of the band has no measurement; the others measure
            what lies up to one pixel beside them.
        range: nearest and farthest depth that is measured [m].
    """

    focal_length: float = 580.0
    baseline: float = 0.075
    disparity_step: float = 0.125
    disparity_noise: float = 0.1
    edge_jump: float = 0.02
    edge_width: int = 3
    edge_dropout: float = 0.7
    range: tuple[float, float] = (0.4, 4.0)

    def measure(
        self, true_depth: NDArray[np.float64], rng: np.random.Generator
    ) -> NDArray[np.float32]:
        """The depth image (metres, 0 = none) that the sensor gives for exact depth (0 = none)."""
        fb = self.focal_length * self.baseline
        edge = self._edge(true_depth)
        seen = np.where(edge, _displaced(true_depth, rng), true_depth)
        disparity = fb / np.where(seen > 0, seen, 1.0)
        disparity += rng.normal(0.0, self.disparity_noise, disparity.shape)
        disparity = np.round(disparity / self.disparity_step) * self.disparity_step
        depth = fb / np.maximum(disparity, self.disparity_step)
        valid = (seen > 0) & (depth >= self.range[0]) & (depth <= self.range[1])
        valid &= ~(edge & (rng.random(edge.shape) < self.edge_dropout))
        return np.where(valid, depth, 0.0).astype(np.float32)

    def _edge(self, true_depth: NDArray[np.float64]) -> NDArray[np.bool_]:
        """The band of edge_width around depth discontinuities."""
        # Inverse depth is linear over the image of a plane, so its second difference is zero there.
        inverse = np.where(true_depth > 0, 1.0 / np.where(true_depth > 0, true_depth, 1.0), 0.0)
        curvature = np.zeros_like(inverse)
        curvature[:, 1:-1] = np.abs(inverse[:, 2:] - 2 * inverse[:, 1:-1] + inverse[:, :-2])
        vertical = np.abs(inverse[2:] - 2 * inverse[1:-1] + inverse[:-2])
        curvature[1:-1] = np.maximum(curvature[1:-1], vertical)
        edge = (curvature * true_depth**2 > self.edge_jump).astype(np.uint8)
        size = 2 * (self.edge_width // 2) + 1
        return cv2.dilate(edge, np.ones((size, size), np.uint8)).astype(bool)


def _displaced(depth: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Depth of a random pixel at most one row and one column away."""
    height, width = depth.shape
    rows = np.arange(height)[:, None] + rng.integers(-1, 2, depth.shape)
    columns = np.arange(width)[None, :] + rng.integers(-1, 2, depth.shape)
    return np.asarray(depth[rows.clip(0, height - 1), columns.clip(0, width - 1)])
