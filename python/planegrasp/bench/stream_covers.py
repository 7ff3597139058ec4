"""What hides objects of a rendered stream: boards that cover one, and something like a hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.scenes import CAMERA, FRONTAL
from planegrasp.bench.stream_motion import Move, Path, travel_time
from planegrasp.geometry import RigidTransform, Rotation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planegrasp.bench.stream_layout import Region, Side

__all__ = ["Sheet", "board", "hand_passes"]

# Depth of boards and of the hand [m]: nearer than every object, and than each other.
BOARD_DEPTH = 0.55
HAND_DEPTH = 0.45
HAND_LENGTH = 0.2
# The hand's greatest speed [m/s], how long it stays and then is away [s].
_HAND_SPEED = (0.3, 0.8)
_HAND_STAY = (0.3, 1.0)
_HAND_AWAY = (0.5, 1.5)


@dataclass(frozen=True, slots=True)
class Sheet:
    """A flat thing that comes into the image, stays in front of something, and goes.

    Attributes:
        path: of its centre.
        width, height: [m].
        start, end: it is outside of the image before and after [s].
    """

    path: Path
    width: float
    height: float
    start: float
    end: float


def board(
    region: Region,
    places: Sequence[RigidTransform],
    radius: float,
    *,
    over: tuple[Side, Side],
    speeds: tuple[float, float],
    start: float,
    hidden: float,
) -> Sheet:
    """A board that covers spheres without leaving the region, but over borders of the image.

    Args:
        region: the spheres are seen inside of it.
        places: centres of the spheres.
        radius: of the spheres [m].
        over: the borders of the image over which it comes and goes.
        speeds: its greatest ones, coming and going [m/s].
        start: when it begins to come [s].
        hidden: how long it stays [s].
    """
    slopes = np.array([_outline(place, radius) for place in places])
    low, high = slopes[:, 0].min(axis=0), slopes[:, 1].max(axis=0)
    centre = BOARD_DEPTH * np.array([*(low + high) / 2, 1.0])
    covering = RigidTransform.from_components(centre, FRONTAL)
    beyond = []
    for side in over:
        border = (region.high if side.sign > 0 else region.low)[side.axis]
        inner = (low if side.sign > 0 else high)[side.axis]
        offset = np.zeros(3)
        # A little farther than the region's border, which lies inside of the image's.
        offset[side.axis] = BOARD_DEPTH * (border - inner + 0.01 * side.sign)
        beyond.append(RigidTransform.from_components(centre + offset, FRONTAL))
    comes = travel_time(beyond[0], covering, speeds[0])
    goes = travel_time(covering, beyond[1], speeds[1])
    there, leaves = start + comes, start + comes + hidden
    path = Path(
        beyond[0],
        (Move(start, there, beyond[0], covering), Move(leaves, leaves + goes, covering, beyond[1])),
    )
    width, height = BOARD_DEPTH * (high - low)
    return Sheet(path, float(width), float(height), start, leaves + goes)


def hand_passes(
    targets: Sequence[Callable[[float], RigidTransform]],
    shortest: Sequence[float],
    rng: np.random.Generator,
    seconds: float,
) -> list[Sheet]:
    """A strip that comes in front of one object after the other, from any direction.

    Args:
        targets: where each object is held at a time [s].
        shortest: length of each object's shorter side [m]; 30 to 60 % of it are hidden at once.
        rng: draws objects, times, directions, speeds and widths.
        seconds: until when it passes.
    """
    passes = []
    t = rng.uniform(*_HAND_AWAY)
    while t < seconds:
        index = int(rng.integers(len(targets)))
        direction, roll, share = rng.uniform((0.0, 0.0, 0.3), (2 * np.pi, 2 * np.pi, 0.6))
        speeds, stay = rng.uniform(*_HAND_SPEED, 2), rng.uniform(*_HAND_STAY)
        # Aim at where the object is when the hand may be there; out of the image there is nothing.
        place = targets[index](t + 1.0).translation
        slope = np.clip(place[:2] / place[2], *_image_slopes())
        rotation = Rotation.from_euler("z", roll) * FRONTAL
        there = RigidTransform.from_components(HAND_DEPTH * np.array([*slope, 1.0]), rotation)
        width = float(share * shortest[index] * HAND_DEPTH / place[2])
        radius = float(np.hypot(width, HAND_LENGTH)) / 2
        come = _outside(there, direction, radius)
        go = _outside(there, direction + rng.uniform(0.5, 1.5) * np.pi, radius)
        arrived = t + travel_time(come, there, speeds[0])
        end = arrived + stay + travel_time(there, go, speeds[1])
        path = Path(come, (Move(t, arrived, come, there), Move(arrived + stay, end, there, go)))
        passes.append(Sheet(path, width, HAND_LENGTH, t, end))
        t = end + rng.uniform(*_HAND_AWAY)
    return passes


def _outline(place: RigidTransform, radius: float) -> tuple[list[float], list[float]]:
    """Least and greatest slopes x/z and y/z of a sphere."""
    x, y, z = place.translation
    low, high = [], []
    for lateral in (x, y):
        angle = np.arctan2(lateral, z)
        spread = np.arcsin(radius / np.hypot(lateral, z))
        low.append(float(np.tan(angle - spread)))
        high.append(float(np.tan(angle + spread)))
    return low, high


def _image_slopes() -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest slopes x/z and y/z in the image."""
    corners = CAMERA.rays([[-0.5, -0.5], [CAMERA.width - 0.5, CAMERA.height - 0.5]])[:, :2]
    return corners[0], corners[1]


def _outside(there: RigidTransform, direction: float, radius: float) -> RigidTransform:
    """The first place in a direction at which a circle around it is out of the image."""
    low, high = _image_slopes()
    heading = np.array([np.cos(direction), np.sin(direction)])
    centre = there.translation
    ends = np.where(heading > 0, high, low) * HAND_DEPTH + np.sign(heading) * radius
    with np.errstate(divide="ignore"):
        way = float(np.min(np.abs((ends - centre[:2]) / heading)))
    return RigidTransform.from_components(centre + way * np.array([*heading, 0.0]), there.rotation)
