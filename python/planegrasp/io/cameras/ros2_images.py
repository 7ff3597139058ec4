"""Frames of the messages of a camera on ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planegrasp.errors import DepthError, SourceError
from planegrasp.io.messages.header import Header, Stamp
from planegrasp.io.sources.ros_images import camera_of, color_of, depth_of
from planegrasp.rgbd import RGBDFrame

if TYPE_CHECKING:
    from collections.abc import Callable

    from planegrasp.geometry import PinholeCamera

__all__ = ["FrameMaker"]


class FrameMaker:
    """Makes frames of images and the latest camera_info.

    Attributes:
        notes: what is to be known of the lens.
        failure: why the latest image could not be used, or "".
    """

    def __init__(self, camera: PinholeCamera | None, depth_scale: float) -> None:
        self.notes: tuple[str, ...] = ()
        self.failure = ""
        self._given = camera
        self._camera = camera
        self._depth_scale = depth_scale
        self._last_info: Any = None

    @property
    def is_calibrated(self) -> bool:
        """Whether there is a camera."""
        return self._camera is not None

    def calibrate(self, info: Any) -> None:
        """Take a camera_info, which counts from the next image on.

        Raises:
            CameraError: it is not calibrated, or of a lens model that is not known.
        """
        key = _content(info)
        if self._given is not None or key == self._last_info:
            return
        self._last_info = key
        self._camera, note = camera_of(info)
        self.notes = (note,) if note else ()

    def frame(
        self, color: Any, depth: Any, name: str, stamp: float, say: Callable[[str], None]
    ) -> RGBDFrame | None:
        """A frame; None as long as there is no camera.

        Args:
            color: message of the colour image.
            depth: message of the depth image, or None.
            name: of the frame.
            stamp: of the frame [s].
            say: is told why depth is of no use; the frame comes without it then.

        Raises:
            SourceError: the colour image has an encoding that is not known, or is damaged.
            CameraError: the camera is for images of another size.
        """
        if self._camera is None:
            return None
        try:
            image = color_of(color)
            metres = self._depth_of(depth, image.shape[:2], say)
            try:
                made = RGBDFrame(image, metres, self._camera, name, stamp)
            except DepthError as error:
                say(f"depth is left out: {error}")
                made = RGBDFrame(image, None, self._camera, name, stamp)
        except Exception as error:
            self.failure = str(error)
            raise
        self.failure = ""
        return made

    @staticmethod
    def header(color: Any, stamp: float) -> Header:
        """Header of an image as it came; the stamp of the frame where it has none."""
        sent = color.header.stamp
        taken = Stamp(sent.sec, sent.nanosec) if (sent.sec, sent.nanosec) > (0, 0) else None
        return Header(taken or Stamp.from_seconds(stamp), color.header.frame_id)

    def _depth_of(self, depth: Any, size: tuple[int, ...], say: Callable[[str], None]) -> Any:
        if depth is None:
            return None
        try:
            metres = depth_of(depth, self._depth_scale)
            if metres.shape != size:
                raise SourceError(
                    f"depth is {metres.shape[1]}×{metres.shape[0]} and colour {size[1]}×{size[0]}: "
                    f"name a topic of depth that is aligned to colour"
                )
        except SourceError as error:
            say(f"depth is left out: {error}")
            return None
        return metres


def _content(info: Any) -> tuple[Any, ...]:
    values = (info.width, info.height, info.distortion_model)
    return (*values, tuple(info.d), tuple(info.k), tuple(info.p))
