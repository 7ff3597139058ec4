"""Rendered RGB-D streams with exact truth: held objects that move, are hidden, leave and return.

docs/benchmarks.md defines them.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from planegrasp.bench import textures
from planegrasp.bench.scenes import CAMERA
from planegrasp.bench.stream_absences import Absence
from planegrasp.bench.stream_stage import stage
from planegrasp.errors import InvalidInputError
from planegrasp.objects import ObjectModel
from planegrasp.simulation import render_moving

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planegrasp.geometry import RigidTransform
    from planegrasp.rgbd import RGBDFrame

__all__ = ["Absence", "StreamFrame", "StreamSettings", "absences", "models", "stream"]

Motion = Literal["still", "handheld"]

# Diagonal of each object by number of objects [m].
_DIAGONALS = {1: 0.3, 3: 0.2, 10: 0.16}


@dataclass(frozen=True, slots=True)
class StreamSettings:
    """What a stream shows.

    Attributes:
        rate: frames a second [Hz].
        seconds: length of the stream.
        objects: how many, 1, 3 or 10, each in its own region of the image.
        exposure: how long the shutter is open [s], at most until the next frame; 0 for no blur.
        motion: "still" or "handheld".
        speed: bound of the hand's drift [m/s]; with ten objects there is less room for it.
        turn: bound of the angle by which the hand turns an object [rad].
        occlusion: whether something like a hand passes in front of objects.
        leaving: whether objects go away again and again, out of the image and behind boards.
        seed: of everything random.

    Raises:
        InvalidInputError: a value is out of its range.
    """

    rate: int = 30
    seconds: float = 10.0
    objects: int = 1
    exposure: float = 0.01
    motion: Motion = "handheld"
    speed: float = 0.2
    turn: float = np.radians(15.0)
    occlusion: bool = False
    leaving: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        if self.rate < 1:
            raise InvalidInputError(f"a stream has at least 1 frame a second, got {self.rate}")
        if not (np.isfinite(self.seconds) and self.seconds * self.rate >= 1):
            raise InvalidInputError(
                f"a stream has at least one frame, got {self.seconds} s at {self.rate} Hz"
            )
        if self.objects not in _DIAGONALS:
            raise InvalidInputError(f"a stream has 1, 3 or 10 objects, got {self.objects}")
        if not 0 <= self.exposure <= 1 / self.rate:
            raise InvalidInputError(
                f"an exposure is from 0 s to the time of a frame, at {self.rate} Hz "
                f"{1 / self.rate:.4g} s, got {self.exposure}"
            )
        if self.motion not in get_args(Motion):
            raise InvalidInputError(
                f"motion is one of {', '.join(get_args(Motion))}, got {self.motion!r}"
            )
        if not (np.isfinite(self.speed) and self.speed >= 0):
            raise InvalidInputError(f"a hand's speed must be ≥ 0 m/s, got {self.speed}")
        if not 0 <= self.turn <= np.radians(30.0):
            raise InvalidInputError(f"a hand turns by 0 to 0.52 rad, got {self.turn}")

    @property
    def frames(self) -> int:
        """Number of frames."""
        return round(self.seconds * self.rate)


@dataclass(frozen=True, slots=True, eq=False)
class StreamFrame:
    """A frame and what is exactly true of it, in the middle of the exposure.

    Attributes:
        frame: with sensor noise; its timestamp is the middle of the exposure [s].
        truth: T_camera_object by name, also of objects that are not seen.
        visible: by name the share of the face that is in the image and not hidden, 0 … 1.
    """

    frame: RGBDFrame
    truth: Mapping[str, RigidTransform]
    visible: Mapping[str, float]


def models(config: StreamSettings) -> list[ObjectModel]:
    """The objects of a stream, to be taught; fewer than ten are well-textured ones by turns."""
    first = np.roll(textures.WELL_TEXTURED, -config.seed)
    names = [*first.tolist(), *textures.FURTHER, *textures.WEAK][: config.objects]
    found = []
    for name in names:
        image = textures.texture(name)
        rows, columns = image.shape[:2]
        width = _DIAGONALS[config.objects] * columns / np.hypot(rows, columns)
        found.append(ObjectModel.from_image(name, image, float(width)))
    return found


def absences(config: StreamSettings) -> tuple[Absence, ...]:
    """When objects of a stream are away, in the order in which they appear again."""
    found = (a for held in stage(config, models(config)).held for a in held.life.absences)
    return tuple(sorted(found, key=lambda a: (a.appears, a.name)))


def stream(config: StreamSettings) -> Iterator[StreamFrame]:
    """Render the frames of a stream; the same configuration gives the same frames."""
    scene = stage(config, models(config))
    for index in range(config.frames):
        time = index / config.rate
        rendering = render_moving(
            scene.things(time, config.exposure),
            time,
            config.exposure,
            CAMERA,
            np.random.default_rng([config.seed, 1, index]),
            background=scene.background,
            name=f"{index:06d}",
        )
        truth, visible = {}, {}
        # Boards and hands come after the objects.
        for held, share in zip(scene.held, rendering.visible, strict=False):
            truth[held.model.name] = held.pose(time)
            # A face may cover a few pixels' centres more than its area says.
            visible[held.model.name] = min(share, 1.0)
        yield StreamFrame(rendering.frame, MappingProxyType(truth), MappingProxyType(visible))
