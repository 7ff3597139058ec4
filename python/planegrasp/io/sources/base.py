"""What a frame source is, and which camera stands in where none is given."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

from planegrasp.errors import CameraError
from planegrasp.geometry import PinholeCamera

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planegrasp.rgbd import RGBDFrame

ASSUMED_FIELD_OF_VIEW = math.radians(60.0)
"""Horizontal field of view of the camera that is assumed where none is given [rad]."""


class FrameSource(Protocol):
    """Something with RGB-D frames, read one at a time; iterating again starts again.

    Iterating raises SourceError for a damaged or missing file, CameraError or DepthError for a
    camera or a depth scale that does not fit: each names the file.
    """

    @property
    def name(self) -> str:
        """What to call the source in outputs: the name of its file or folder."""
        ...

    @property
    def length(self) -> int | None:
        """Number of frames, or None where only reading them all would tell."""
        ...

    @property
    def camera(self) -> PinholeCamera | None:
        """The camera of all frames, or None where each frame brings its own."""
        ...

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know, one sentence each: an assumed camera, frames left out."""
        ...

    def __iter__(self) -> Iterator[RGBDFrame]:
        """The frames in order."""
        ...


def assumed_camera(
    width: int, height: int, field_of_view: float = ASSUMED_FIELD_OF_VIEW
) -> PinholeCamera:
    """A camera without distortion that looks through the middle of a width × height image.

    Args:
        width: of the image [px].
        height: of the image [px].
        field_of_view: horizontal, between the outer edges of the image [rad].

    Raises:
        CameraError: the field of view is not between 0 and π.
    """
    if not 0.0 < field_of_view < math.pi:
        raise CameraError(
            f"the field of view must lie between 0° and 180°, "
            f"got {math.degrees(field_of_view):.6g}°"
        )
    focal = width / 2 / math.tan(field_of_view / 2)
    return PinholeCamera(
        width=width, height=height, fx=focal, fy=focal, cx=(width - 1) / 2, cy=(height - 1) / 2
    )


def assumption_note(field_of_view: float | None) -> str:
    """What to tell the user whose frames come without a camera."""
    angle = math.degrees(ASSUMED_FIELD_OF_VIEW if field_of_view is None else field_of_view)
    origin = "assuming" if field_of_view is None else "taking"
    return (
        f"no camera given: {origin} a horizontal field of view of {angle:.3g}°, so distances and "
        f"angles are approximate; give a camera file for exact poses"
    )
