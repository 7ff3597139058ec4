"""Frames that lie in image files: every layout of folders comes down to a list of these."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError, SourceError
from planegrasp.io.images import MILLIMETRES, read_color, read_depth
from planegrasp.rgbd import RGBDFrame

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from planegrasp.geometry import PinholeCamera

    CameraForSize = Callable[[int, int], PinholeCamera]


@dataclass(frozen=True, slots=True)
class FrameFiles:
    """Where one frame lies.

    Attributes:
        name: of the frame, unique in its sequence.
        color: colour image.
        depth: depth image, or None.
        camera: gives the camera of a width × height image; some layouts store no image size.
        depth_scale: metres per unit of the depth image.
        timestamp: seconds, or None.
    """

    name: str
    color: Path
    depth: Path | None
    camera: CameraForSize
    depth_scale: float = MILLIMETRES
    timestamp: float | None = None

    def read(self) -> RGBDFrame:
        """Read the images.

        Raises:
            SourceError: an image is missing or damaged, or the two differ in size.
            CameraError: the camera is for another image size.
            DepthError: the depth is not in metres at this depth scale.
        """
        color = read_color(self.color)
        height, width = color.shape[:2]
        depth = None if self.depth is None else read_depth(self.depth, self.depth_scale)
        if depth is not None and depth.shape != (height, width):
            raise SourceError(
                f"colour and depth must have one size, but {self.color} is {width}×{height} "
                f"and {self.depth} is {depth.shape[1]}×{depth.shape[0]}"
            )
        try:
            return RGBDFrame(color, depth, self.camera(width, height), self.name, self.timestamp)
        except InvalidInputError as error:
            where = str(self.color)
            if self.depth is not None:
                where += f" with depth {self.depth} at {self.depth_scale:.6g} m per unit"
            raise type(error)(f"{where}: {error}") from error


class ImageSequence:
    """A `FrameSource` over files: one image, a folder, a data set."""

    def __init__(
        self,
        name: str,
        files: Sequence[FrameFiles],
        camera: PinholeCamera | None = None,
        notes: tuple[str, ...] = (),
    ) -> None:
        self.name = name
        self.files = tuple(files)
        self.camera = camera
        self.notes = notes

    @property
    def length(self) -> int:
        """Number of frames."""
        return len(self.files)

    def __len__(self) -> int:
        return len(self.files)

    def __iter__(self) -> Iterator[RGBDFrame]:
        for files in self.files:
            yield files.read()


def fixed_camera(camera: PinholeCamera) -> CameraForSize:
    """The same camera whatever the image size; `RGBDFrame` refuses an image that it is not for."""
    return lambda width, height: camera


def natural_key(path: Path) -> tuple[list[tuple[int, int, str]], str]:
    """Sort key that puts 2.png before 10.png: numbers by value, the rest by letter."""
    parts = [
        (0, int(part), "") if part.isdecimal() else (1, 0, part.lower())
        for part in re.split(r"(\d+)", path.name)
        if part
    ]
    return parts, path.name
