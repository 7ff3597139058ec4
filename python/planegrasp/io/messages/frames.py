"""What frames are called in messages."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform

__all__ = ["OPTICAL_IN_BODY", "FrameIds"]

OPTICAL_IN_BODY = RigidTransform.from_matrix(
    np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64)
)
"""T_body_optical of a camera by REP-103: the body's x is forward, y left, z up."""


@dataclass(frozen=True, slots=True)
class FrameIds:
    """Names of frames (docs/conventions.md).

    Attributes:
        camera: the camera's optical frame (x right, y down, z forward), where the images do not
            name their own.
        fixed: the frame in which tracks live; "" for the camera's own, where it stands still or
            moves in an unknown way.
        objects: what the names of objects' frames begin with.

    Raises:
        InvalidInputError: a name is empty where it must not be, or begins with a slash.
    """

    camera: str = "camera_color_optical_frame"
    fixed: str = ""
    objects: str = "objects/"

    def __post_init__(self) -> None:
        if not self.camera:
            raise InvalidInputError("the camera's frame needs a name")
        for name in (self.camera, self.fixed, self.objects):
            if name.startswith("/"):
                raise InvalidInputError(f"names of frames have no slash at the start, got {name!r}")

    def object(self, name: str, instance: int = 0) -> str:
        """The frame of an object: ``objects/NAME``, of a further one ``objects/NAME/INSTANCE``."""
        return f"{self.objects}{name}" + (f"/{instance}" if instance else "")
