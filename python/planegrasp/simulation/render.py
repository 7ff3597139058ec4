"""Ray-cast textured rectangles into a pinhole camera, anti-aliased, with exact depth.

Every pixel of the image is the mean over the pixel's square of the texture that its rays hit, as a
sensor with full fill factor would see it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.rgbd import RGBDFrame
from planegrasp.simulation.canvas import Canvas, far_to_near, paint_color, paint_depth
from planegrasp.simulation.depth_sensor import KinectV1

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.simulation.rectangle import Rectangle


@dataclass(frozen=True, slots=True, eq=False)
class Rendering:
    """A rendered frame and what is exactly true of it.

    Attributes:
        frame: with sensor noise.
        true_depth: H×W float64 metres without noise, 0 = nothing hit.
        corners: for each rectangle its 4×2 corner pixels (as observed), None if it faces away.
        visible: for each rectangle the share of its projected pixels, 0 … 1, that are in the image
            and not hidden by a nearer rectangle.
    """

    frame: RGBDFrame
    true_depth: NDArray[np.float64]
    corners: tuple[NDArray[np.float64] | None, ...]
    visible: tuple[float, ...]


def render(
    rectangles: Sequence[Rectangle],
    camera: PinholeCamera,
    rng: np.random.Generator,
    *,
    background: NDArray[np.uint8] | None = None,
    background_depth: float = 1.5,
    color_noise: float = 3.0,
    depth_sensor: KinectV1 | None = None,
    name: str = "",
) -> Rendering:
    """Render rectangles before a background.

    Args:
        rectangles: in any order; they must not cut through each other.
        camera: distortion is rendered.
        rng: for the sensor noise.
        background: H×W×3 uint8 RGB, stretched over the image; mid grey where None.
        background_depth: distance of the background plane [m].
        color_noise: standard deviation of the image noise [grey levels].
        depth_sensor: Kinect v1 where None.
        name: of the frame.
    """
    canvas = Canvas.blank(camera, background, background_depth)
    for index in far_to_near(rectangles):
        paint_color(rectangles[index], camera, canvas.image)
    sensors = Sensors(camera, rng, color_noise, depth_sensor or KinectV1())
    return sensors.take(rectangles, canvas, name=name)


@dataclass(frozen=True, slots=True, eq=False)
class Sensors:
    """The colour and the depth sensor of a camera.

    Attributes:
        camera: of both.
        rng: for the noise.
        color_noise: standard deviation [grey levels].
        depth: the depth sensor.
    """

    camera: PinholeCamera
    rng: np.random.Generator
    color_noise: float
    depth: KinectV1

    def take(
        self,
        rectangles: Sequence[Rectangle],
        canvas: Canvas,
        *,
        name: str = "",
        timestamp: float | None = None,
    ) -> Rendering:
        """The frame of a canvas that has its colour already; depth and truth are entered here."""
        projected = np.zeros(len(rectangles), np.int64)
        for index in far_to_near(rectangles):
            projected[index] = paint_depth(rectangles[index], index, self.camera, canvas)
        noisy = canvas.image + self.rng.normal(0.0, self.color_noise, canvas.image.shape)
        frame = RGBDFrame(
            color=np.clip(np.rint(noisy), 0, 255).astype(np.uint8),
            depth=self.depth.measure(canvas.depth, self.rng),
            camera=self.camera,
            name=name,
            timestamp=timestamp,
        )
        corners = tuple(
            self.camera.project(r.corners) if r.faces_camera else None for r in rectangles
        )
        visible = tuple(
            float(np.count_nonzero(canvas.owner == i) / projected[i]) if projected[i] else 0.0
            for i in range(len(rectangles))
        )
        return Rendering(frame, canvas.depth, corners, visible)
