"""Frames of one photograph that moves on a known path."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.scenes import CAMERA, facing_pose, rectangles
from planegrasp.bench.textures import random_background
from planegrasp.simulation import Rectangle, render

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planegrasp.geometry import PinholeCamera, RigidTransform
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

RATE = 30.0


def swaying(time: float) -> RigidTransform:
    """Some centimetres to and fro within seconds, at a tilt of 20 to 40°."""
    position = np.array([0.06 * np.sin(1.5 * time), 0.03 * np.cos(time), 0.7 + 0.04 * np.sin(time)])
    return facing_pose(position, np.radians(30 + 10 * np.sin(2 * time)), 0.7, 0.3 + 0.2 * time)


def frames(
    model: ObjectModel,
    path: Callable[[float], RigidTransform],
    count: int,
    *,
    seed: int = 0,
    others: Callable[[int], list[Rectangle]] = lambda number: [],
    camera: PinholeCamera = CAMERA,
) -> Iterator[tuple[RGBDFrame, RigidTransform]]:
    """Noisy frames with the true T_camera_object."""
    rng = np.random.default_rng(seed)
    background = random_background(rng)
    for number in range(count):
        time = number / RATE
        T = path(time)
        scene = [*rectangles(model, T), *others(number)]
        rendering = render(scene, camera, rng, background=background)
        yield replace(rendering.frame, timestamp=time), T


def cover(distance: float = 0.45, width: float = 0.4) -> Rectangle:
    """A sheet of one colour that hides what is in the middle of the image."""
    texture = np.full((40, 40, 3), 150, np.uint8)
    return Rectangle(texture, width, width, facing_pose(np.array([0.0, 0.0, distance]), 0, 0, 0))
