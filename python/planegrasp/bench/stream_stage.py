"""What stands and moves before the camera of a rendered stream."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.bench import textures
from planegrasp.bench.scenes import CAMERA, rectangles
from planegrasp.bench.stream_absences import DISTANCE, Life, live
from planegrasp.bench.stream_covers import Sheet, hand_passes
from planegrasp.bench.stream_layout import regions
from planegrasp.geometry import RigidTransform
from planegrasp.simulation import Rectangle
from planegrasp.simulation.hand_motion import HandMotion, HandMotionConfig

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from planegrasp.bench.stream import StreamSettings
    from planegrasp.objects import ObjectModel

__all__ = ["Held", "Stage", "stage"]

# Share of the room in its region through which a hand moves an object; the rest is for places.
_MOVING_SHARE = 0.7
_TREMOR = 0.001
_WANDER_BAND = (0.2, 1.0)
_LARGEST_EXCURSION = 0.08


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """An object, what happens to it, and how the hand that holds it moves.

    Attributes:
        model: with one face.
        life: where it is held.
        hand: its motion about there, None where all is still.
    """

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
class Stage:
    """All that a stream shows.

    Attributes:
        held: the objects.
        sheets: boards and hands, each with its texture.
        background: of the size of the image.
    """

    held: tuple[Held, ...]
    sheets: tuple[tuple[Sheet, NDArray[np.uint8]], ...]
    background: NDArray[np.uint8]

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


def stage(config: StreamSettings, models: Sequence[ObjectModel]) -> Stage:
    """Draw everything but the noise of the sensors."""
    rng = np.random.default_rng([config.seed, 0])
    places = regions(config.objects)
    held = []
    for index, model in zip(rng.permutation(len(places)), models, strict=True):
        region = places[index]
        face = model.faces[0]
        radius = float(np.hypot(face.width, face.height)) / 2
        hand = None
        if config.motion == "handheld":
            excursion = _MOVING_SHARE * (region.room(DISTANCE) - radius - _TREMOR)
            motion = HandMotionConfig(
                speed=config.speed,
                excursion=min(_LARGEST_EXCURSION, excursion),
                turn=config.turn,
                wander_band=_WANDER_BAND,
                tremor=_TREMOR,
            )
            hand = HandMotion(RigidTransform.identity(), rng, motion)
            radius += motion.excursion + _TREMOR
        life = live(
            model.name,
            region,
            radius,
            rng,
            seconds=config.seconds,
            rate=config.rate,
            leaving=config.leaving,
        )
        held.append(Held(model, life, hand))
    sheets = [sheet for h in held for sheet in h.life.boards]
    if config.occlusion:
        shortest = [min(h.model.faces[0].width, h.model.faces[0].height) for h in held]
        sheets += hand_passes([h.life.path.pose for h in held], shortest, rng, config.seconds)
    images = textures.scenery()
    crops = [
        textures.random_crop(images[int(rng.integers(len(images)))], rng)
        for _ in range(len(sheets) + 1)
    ]
    size = (CAMERA.width, CAMERA.height)
    background = cv2.resize(crops[-1], size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    return Stage(tuple(held), tuple(zip(sheets, crops[:-1], strict=True)), background)


def _moving(sheet: Sheet, image: NDArray[np.uint8]) -> Callable[[float], Rectangle]:
    texture = np.ascontiguousarray(image)
    return lambda t: Rectangle(texture, sheet.width, sheet.height, sheet.path.pose(t))
