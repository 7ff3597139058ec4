"""Ray-cast textured rectangles into a pinhole camera, anti-aliased, with exact depth.

Every pixel of the image is the mean over the pixel's square of the texture that its rays hit, as a
sensor with full fill factor would see it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.rgbd import RGBDFrame
from planegrasp.simulation.depth_sensor import KinectV1
from planegrasp.simulation.rectangle import Rectangle, level_of_detail, polygon_area, sample

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera


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
    size = (camera.width, camera.height)
    if background is None:
        image = np.full((camera.height, camera.width, 3), 128.0, np.float32)
    else:
        image = cv2.resize(background, size, interpolation=cv2.INTER_AREA).astype(np.float32)
    depth = np.full((camera.height, camera.width), background_depth, np.float64)
    owner = np.full(depth.shape, -1, np.int32)
    projected = np.zeros(len(rectangles), np.int64)

    canvas = _Canvas(image, depth, owner)
    for index in _far_to_near(rectangles):
        projected[index] = _paint(rectangles[index], index, camera, canvas)

    noisy = image + rng.normal(0.0, color_noise, image.shape)
    sensor = depth_sensor or KinectV1()
    frame = RGBDFrame(
        color=np.clip(np.rint(noisy), 0, 255).astype(np.uint8),
        depth=sensor.measure(depth, rng),
        camera=camera,
        name=name,
    )
    corners = tuple(camera.project(r.corners) if r.faces_camera else None for r in rectangles)
    visible = tuple(
        float(np.count_nonzero(owner == i) / projected[i]) if projected[i] else 0.0
        for i in range(len(rectangles))
    )
    return Rendering(frame, depth, corners, visible)


@dataclass(frozen=True, slots=True, eq=False)
class _Canvas:
    """Colour, depth and the index of the rectangle that each pixel shows; painted in place."""

    image: NDArray[np.float32]
    depth: NDArray[np.float64]
    owner: NDArray[np.int32]


def _far_to_near(rectangles: Sequence[Rectangle]) -> list[int]:
    """Those that face the camera, each before the ones that can hide it.

    The distance of the centres would not do: an oblique board that hides a face may have its
    centre farther away than the face has.
    """
    remaining = sorted(
        (i for i, r in enumerate(rectangles) if r.faces_camera),
        key=lambda i: -float(rectangles[i].T_camera_rectangle.translation[2]),
    )
    order: list[int] = []
    while remaining:
        hides_none = (
            i
            for i in remaining
            if not any(_hides(rectangles[i], rectangles[j]) for j in remaining if j != i)
        )
        # Three boards each leaning on the next hide each other in a circle.
        order.append(next(hides_none, remaining[0]))
        remaining.remove(order[-1])
    return order


def _hides(near: Rectangle, far: Rectangle) -> bool:
    """Whether `near` can hide `far` but not the other way round; both face the camera."""
    far_from_near, near_from_far = _heights(far.corners, near), _heights(near.corners, far)
    far_can_hide = bool(np.any(far_from_near > 1e-9) and np.any(near_from_far < -1e-9))
    near_can_hide = bool(np.any(near_from_far > 1e-9) and np.any(far_from_near < -1e-9))
    return near_can_hide and not far_can_hide


def _heights(points: NDArray[np.float64], rectangle: Rectangle) -> NDArray[np.float64]:
    """Distances of N×3 points from a rectangle's plane [m], positive on its textured side."""
    translation, rotation = rectangle.T_camera_rectangle.as_components()
    return np.asarray((points - translation) @ rotation.as_matrix()[:, 2], dtype=np.float64)


def _paint(rectangle: Rectangle, index: int, camera: PinholeCamera, canvas: _Canvas) -> int:
    """Paint one rectangle over what lies behind it; return how many pixels it projects to."""
    corners = camera.project(rectangle.corners)
    pixels = polygon_area(corners)
    low = np.floor(corners.min(axis=0)).astype(int) - 1
    high = np.ceil(corners.max(axis=0)).astype(int) + 2
    x0, y0 = np.maximum(low, 0)
    x1, y1 = np.minimum(high, (camera.width, camera.height))
    if x0 >= x1 or y0 >= y1:
        return round(pixels)

    texture, samples = level_of_detail(rectangle, corners)
    color, coverage = sample(rectangle, texture, camera, (x0, y0, x1, y1), samples)
    region = np.s_[y0:y1, x0:x1]
    canvas.image[region] = color + (1.0 - coverage[..., None]) * canvas.image[region]

    u, v = np.meshgrid(np.arange(x0, x1), np.arange(y0, y1))
    rays = camera.rays(np.column_stack([u.ravel(), v.ravel()]))
    translation, rotation = rectangle.T_camera_rectangle.as_components()
    R = rotation.as_matrix()
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (R[:, 2] @ translation) / (rays @ R[:, 2])
    on_plane = (rays * z[:, None] - translation) @ R
    hit = (
        (z > 0)
        & (np.abs(on_plane[:, 0]) <= rectangle.width / 2)
        & (np.abs(on_plane[:, 1]) <= rectangle.height / 2)
    ).reshape(u.shape)
    canvas.depth[region] = np.where(hit, z.reshape(u.shape), canvas.depth[region])
    canvas.owner[region] = np.where(hit, index, canvas.owner[region])
    return round(pixels)
