"""What there is to be seen while ROS 2 is measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from planegrasp.bench.stream import StreamSettings, models, stream
from planegrasp.detector import Detector

if TYPE_CHECKING:
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

_SECONDS = 20 / 30  # of the stream, which is played to and fro


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """One object before a camera.

    Attributes:
        objects: the one that was taught.
        detector: of it.
        frames: at 30 Hz.
    """

    objects: tuple[ObjectModel, ...]
    detector: Detector
    frames: tuple[RGBDFrame, ...]

    @classmethod
    def of(cls, seed: int) -> Self:
        """Render the stream of a seed, and learn the object."""
        config = StreamSettings(seconds=_SECONDS, objects=1, seed=seed)
        objects = tuple(models(config))
        return cls(objects, Detector(objects), tuple(one.frame for one in stream(config)))
