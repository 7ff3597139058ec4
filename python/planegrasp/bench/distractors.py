"""Frames full of things that are not the taught objects."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.scenes import CAMERA, random_pose
from planegrasp.bench.textures import backgrounds, random_background
from planegrasp.simulation import Rectangle, render

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.rgbd import RGBDFrame


def distractor_scene(
    rng: np.random.Generator, name: str = "", camera: PinholeCamera = CAMERA
) -> RGBDFrame:
    """A photographic background with one to four flat, textured things before it."""
    things = []
    for i in range(int(rng.integers(1, 5))):
        image = _random_texture(rng)
        width = rng.uniform(0.1, 0.35)
        height = width * image.shape[0] / image.shape[1]
        # Each thing at its own distance, so that none cuts through another.
        distance = 0.55 + 0.2 * i
        pose = random_pose(rng, rng.uniform(0.0, 1.2), distance, offset=(0.3, 0.2))
        things.append(Rectangle(image, width, height, pose))
    return render(
        things, camera, rng, background=random_background(rng), background_depth=1.8, name=name
    ).frame


def _random_texture(rng: np.random.Generator) -> NDArray[np.uint8]:
    """A crop of a background, or a pattern of blocks or of smooth noise."""
    kind = rng.integers(3)
    if kind == 0:
        return np.ascontiguousarray(random_background(rng))
    if kind == 1:
        blocks = rng.integers(0, 256, (int(rng.integers(6, 40)), int(rng.integers(6, 40)), 3))
        return np.kron(blocks, np.ones((12, 12, 1))).astype(np.uint8)
    image = backgrounds()[int(rng.integers(len(backgrounds())))]
    size = int(min(image.shape[:2]) * rng.uniform(0.3, 0.9))
    y, x = rng.integers(image.shape[0] - size), rng.integers(image.shape[1] - size)
    crop = np.ascontiguousarray(np.rot90(image[y : y + size, x : x + size], int(rng.integers(4))))
    return crop if rng.random() < 0.5 else np.ascontiguousarray(255 - crop)
