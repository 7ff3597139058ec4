"""Rendered RGB-D streams with exact truth: held objects that move, are hidden, leave and return.

docs/benchmarks.md defines them.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, get_args

import cv2
import numpy as np

from planegrasp.bench import textures
from planegrasp.bench.scenes import CAMERA, rectangles
from planegrasp.bench.stream_absences import DISTANCE, Absence, Life, live
from planegrasp.bench.stream_covers import Sheet, hand_passes
from planegrasp.bench.stream_layout import regions
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform
from planegrasp.objects import ObjectModel
from planegrasp.simulation import Rectangle, render_moving
from planegrasp.simulation.hand_motion import HandMotion, HandMotionConfig

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from planegrasp.rgbd import RGBDFrame

__all__ = ["Absence", "StreamConfig", "StreamFrame", "absences", "models", "stream"]

Motion = Literal["still", "handheld"]

# Diagonal of each object by number of objects [m].
_DIAGONALS = {1: 0.3, 3: 0.2, 10: 0.16}
# Share of the room in its region through which a hand moves an object; the rest is for places.
_MOVING_SHARE = 0.7
_TREMOR = 0.001
_WANDER_BAND = (0.2, 1.0)
_LARGEST_EXCURSION = 0.08


@dataclass(frozen=True, slots=True)
class StreamConfig:
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


def models(config: StreamConfig) -> list[ObjectModel]:
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


def absences(config: StreamConfig) -> tuple[Absence, ...]:
    """When objects of a stream are away, in the order in which they appear again."""
    held = _Stage.of(config).held
    return tuple(
        sorted((a for h in held for a in h.life.absences), key=lambda a: (a.appears, a.name))
    )


def stream(config: StreamConfig) -> Iterator[StreamFrame]:
    """Render the frames of a stream; the same configuration gives the same frames."""
    stage = _Stage.of(config)
    for index in range(config.frames):
        time = index / config.rate
        things = stage.things(time, config.exposure)
        rendering = render_moving(
            things,
            time,
            config.exposure,
            CAMERA,
            np.random.default_rng([config.seed, 1, index]),
            background=stage.background,
            name=f"{index:06d}",
        )
        names = [held.model.name for held in stage.held]
        yield StreamFrame(
            rendering.frame,
            MappingProxyType({h.model.name: h.pose(time) for h in stage.held}),
            # The pixels' centres that a face covers may be a few more than its area says.
            MappingProxyType(
                {
                    name: min(share, 1.0)
                    for name, share in zip(names, rendering.visible, strict=False)
                }
            ),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Held:
    """An object, what happens to it, and how the hand that holds it moves."""

    model: ObjectModel
    life: Life
    hand: HandMotion | None

    def pose(self, t: float) -> RigidTransform:
        """T_camera_object at a time [s]."""
        held = self.life.path.pose(t)
        if self.hand is None:
            return held
        moved = self.hand.pose(t)
        return RigidTransform.from_components(
            held.translation + moved.translation, moved.rotation * held.rotation
        )

    def rectangle(self, t: float) -> Rectangle:
        """Its face at a time [s]."""
        return rectangles(self.model, self.pose(t))[0]


@dataclass(frozen=True, slots=True, eq=False)
class _Stage:
    """All that a stream shows.

    Attributes:
        held: the objects.
        sheets: boards and hands, each with its texture.
        background: of the size of the image.
    """

    held: tuple[_Held, ...]
    sheets: tuple[tuple[Sheet, NDArray[np.uint8]], ...]
    background: NDArray[np.uint8]

    @classmethod
    def of(cls, config: StreamConfig) -> _Stage:
        """Draw everything but the noise of the sensors."""
        rng = np.random.default_rng([config.seed, 0])
        places = regions(config.objects)
        order = rng.permutation(len(places))
        held = []
        for index, model in zip(order, models(config), strict=True):
            region = places[index]
            radius = _DIAGONALS[config.objects] / 2
            hand = None
            if config.motion == "handheld":
                spare = region.room(DISTANCE) - radius - _TREMOR
                excursion = min(_LARGEST_EXCURSION, _MOVING_SHARE * spare)
                hand = HandMotion(
                    RigidTransform.identity(),
                    rng,
                    HandMotionConfig(
                        speed=config.speed,
                        excursion=excursion,
                        turn=config.turn,
                        wander_band=_WANDER_BAND,
                        tremor=_TREMOR,
                    ),
                )
                radius += excursion + _TREMOR
            life = live(
                model.name,
                region,
                radius,
                rng,
                seconds=config.seconds,
                rate=config.rate,
                leaving=config.leaving,
            )
            held.append(_Held(model, life, hand))
        sheets = [sheet for h in held for sheet in h.life.boards]
        if config.occlusion:
            shortest = [min(h.model.faces[0].width, h.model.faces[0].height) for h in held]
            paths = [h.life.path.pose for h in held]
            sheets += hand_passes(paths, shortest, rng, config.seconds)
        images = textures.scenery()
        crops = [
            np.ascontiguousarray(textures.random_crop(images[int(rng.integers(len(images)))], rng))
            for _ in range(len(sheets) + 1)
        ]
        size = (CAMERA.width, CAMERA.height)
        background = cv2.resize(crops[-1], size, interpolation=cv2.INTER_AREA).astype(np.uint8)
        return cls(tuple(held), tuple(zip(sheets, crops[:-1], strict=True)), background)

    def things(self, time: float, exposure: float) -> Sequence[Callable[[float], Rectangle]]:
        """The objects in their order, then what else may be in view during an exposure."""
        begin, end = time - exposure / 2, time + exposure / 2
        return [
            *(held.rectangle for held in self.held),
            *(
                _moving(sheet, image)
                for sheet, image in self.sheets
                if sheet.start <= end and begin <= sheet.end
            ),
        ]


def _moving(sheet: Sheet, image: NDArray[np.uint8]) -> Callable[[float], Rectangle]:
    return lambda t: Rectangle(image, sheet.width, sheet.height, sheet.path.pose(t))
