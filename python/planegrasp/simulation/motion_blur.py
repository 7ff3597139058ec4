"""Frames of rectangles that move while the shutter is open.

A pixel of the colour image is the mean over the exposure. It is taken over sub-exposures, so many
that nothing moves by more than a pixel from one to the next; noise is added once. Depth and all
that is said to be true are of the middle of the exposure.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.simulation.canvas import Canvas, far_to_near, paint_color, window
from planegrasp.simulation.depth_sensor import KinectV1
from planegrasp.simulation.render import Sensors

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.simulation.rectangle import Rectangle
    from planegrasp.simulation.render import Rendering

    # Where a rectangle is at a time [s].
    Moving = Callable[[float], Rectangle]

__all__ = ["render_moving"]


def render_moving(
    rectangles: Sequence[Moving],
    time: float,
    exposure: float,
    camera: PinholeCamera,
    rng: np.random.Generator,
    *,
    background: NDArray[np.uint8] | None = None,
    background_depth: float = 1.5,
    color_noise: float = 3.0,
    depth_sensor: KinectV1 | None = None,
    name: str = "",
) -> Rendering:
    """Render moving rectangles before a still background, with motion blur.

    Args:
        rectangles: each one as it is at a time [s]; at no time do they cut through each other.
        time: of the middle of the exposure [s]; the frame's timestamp.
        exposure: how long the shutter is open [s]. Where it is 0, or nothing moves by more than a
            pixel, the frame is the one of `render`.
        camera: distortion is rendered.
        rng: for the sensor noise.
        background: H×W×3 uint8 RGB, stretched over the image; mid grey where None.
        background_depth: distance of the background plane [m].
        color_noise: standard deviation of the image noise [grey levels].
        depth_sensor: Kinect v1 where None.
        name: of the frame.

    Raises:
        InvalidInputError: the exposure is negative or not finite.
    """
    if not (np.isfinite(exposure) and exposure >= 0):
        raise InvalidInputError(f"an exposure must be ≥ 0 s and finite, got {exposure}")
    canvas = Canvas.blank(camera, background, background_depth)
    for group in _groups([_swept(r, time, exposure, camera) for r in rectangles]):
        count = max(1, int(np.ceil(group.motion)))
        offsets = exposure * ((np.arange(count) + 0.5) / count - 0.5)
        snapshots = [[rectangles[i](time + dt) for i in group.members] for dt in offsets.tolist()]
        _paint_mean(snapshots, group.roi, camera, canvas.image)
    sensors = Sensors(camera, rng, color_noise, depth_sensor or KinectV1())
    return sensors.take([r(time) for r in rectangles], canvas, name=name, timestamp=time)


@dataclass(frozen=True, slots=True)
class _Group:
    """Rectangles whose images may overlap during the exposure.

    Attributes:
        members: their indices.
        roi: the pixels that they may touch: x from, y from, x to, y to.
        motion: the longest way of a corner [px].
    """

    members: tuple[int, ...]
    roi: tuple[int, int, int, int]
    motion: float

    def overlaps(self, other: _Group) -> bool:
        a, b = self.roi, other.roi
        return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]

    def joined(self, other: _Group) -> _Group:
        a, b = self.roi, other.roi
        roi = (min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3]))
        return _Group(self.members + other.members, roi, max(self.motion, other.motion))


def _swept(
    rectangle: Moving, time: float, exposure: float, camera: PinholeCamera
) -> tuple[tuple[int, int, int, int] | None, float]:
    """The pixels that a rectangle may touch during the exposure, and its motion [px]."""
    moments = (rectangle(time + share * exposure) for share in (-0.5, 0.0, 0.5))
    corners = [camera.project(r.corners) for r in moments if r.faces_camera]
    if not corners:
        return None, 0.0
    ways = np.zeros(4)
    for a, b in pairwise(corners):
        ways += np.linalg.norm(b - a, axis=1)
    motion = float(ways.max())
    # Between these moments a corner may leave their hull, but hardly by as much as it moves.
    outline = np.concatenate(corners)
    margin = np.array([[-motion, -motion], [motion, motion]]) / 2
    return window((outline[:, None] + margin).reshape(-1, 2), camera), motion


def _groups(
    swept: Sequence[tuple[tuple[int, int, int, int] | None, float]],
) -> list[_Group]:
    """Those in the image by overlap: what does not overlap needs no common sub-exposures."""
    groups: list[_Group] = []
    for index, (roi, motion) in enumerate(swept):
        if roi is None:
            continue
        group = _Group((index,), roi, motion)
        while touching := [other for other in groups if other.overlaps(group)]:
            for other in touching:
                group = other.joined(group)
                groups.remove(other)
        groups.append(group)
    return groups


def _paint_mean(
    snapshots: Sequence[Sequence[Rectangle]],
    roi: tuple[int, int, int, int],
    camera: PinholeCamera,
    image: NDArray[np.float32],
) -> None:
    """Paint the mean of several snapshots of the same rectangles over what lies behind them."""
    order = far_to_near(snapshots[len(snapshots) // 2])
    if len(snapshots) == 1:
        for index in order:
            paint_color(snapshots[0][index], camera, image)
        return
    region = np.s_[roi[1] : roi[3], roi[0] : roi[2]]
    total = np.zeros_like(image[region])
    scratch = image.copy()
    for snapshot in snapshots:
        scratch[region] = image[region]
        for index in order:
            paint_color(snapshot[index], camera, scratch)
        total += scratch[region]
    image[region] = total / np.float32(len(snapshots))
