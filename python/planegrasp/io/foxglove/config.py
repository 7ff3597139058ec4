"""What is logged for Foxglove, and under which names."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from planegrasp.errors import InvalidInputError

__all__ = ["ColorFormat", "FoxgloveConfig", "FoxgloveTopics"]


class ColorFormat(StrEnum):
    """How colour images are stored."""

    PNG = "png"
    """Without loss."""
    JPEG = "jpeg"
    """A seventh of the size, but not exactly what the camera gave."""
    RAW = "raw"
    """Without loss, and readable for what knows no PNG; large on the network."""

    @classmethod
    def named(cls, name: str) -> ColorFormat:
        """The format of that name.

        Raises:
            InvalidInputError: there is none.
        """
        try:
            return cls(name)
        except ValueError:
            known = ", ".join(cls)
            raise InvalidInputError(f"colour is stored as one of {known}, got {name!r}") from None


@dataclass(frozen=True, slots=True)
class FoxgloveConfig:
    """What is logged.

    Attributes:
        color: how colour images are stored.
        jpeg_quality: of `ColorFormat.JPEG`, 1 … 100.
        cloud_points: of the coloured cloud of a depth image, at most about so many; 0 for none.
        image_rate: images and clouds a second of the frames' time, at most [Hz]; 0 for none, None
            for those of every frame.

    Raises:
        InvalidInputError: a value is out of its range.
    """

    color: ColorFormat = ColorFormat.PNG
    jpeg_quality: int = 90
    cloud_points: int = 5000
    image_rate: float | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.jpeg_quality <= 100:
            raise InvalidInputError(f"the quality of JPEG is 1 … 100, got {self.jpeg_quality}")
        if self.cloud_points < 0:
            raise InvalidInputError(f"a cloud has ≥ 0 points, got {self.cloud_points}")
        if self.image_rate is not None and not 0.0 <= self.image_rate <= 1000.0:
            raise InvalidInputError(
                f"the rate of images is from 0 to 1000 Hz, got {self.image_rate}"
            )


@dataclass(frozen=True, slots=True)
class FoxgloveTopics:
    """Names of topics.

    The camera's are found again by `open_source`, which goes by "color", "depth", "aligned".
    """

    color: str = "/camera/color/image"
    calibration: str = "/camera/color/calibration"
    annotations: str = "/camera/color/annotations"
    depth: str = "/camera/aligned_depth_to_color/image"
    cloud: str = "/camera/aligned_depth_to_color/points"
    transforms: str = "/tf"
    scene: str = "/planegrasp/scene"
    detections: str = "/planegrasp/detections"
    tracks: str = "/planegrasp/tracks"
    grasp_plans: str = "/planegrasp/grasp_plans"
    grasp_refusals: str = "/planegrasp/grasp_refusals"
    grasp_scene: str = "/planegrasp/grasp_scene"
    library: str = "/planegrasp/library"
    events: str = "/planegrasp/events"
