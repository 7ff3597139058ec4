"""Logs what the camera sees: images, calibration, cloud, and what is drawn over them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.io.foxglove.annotations import image_annotations
from planegrasp.io.foxglove.images import calibration, cloud, color_image, depth_image
from planegrasp.undistorted import Undistorted
from planegrasp.viz.picture_rate import PictureRate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planegrasp.detection import Detection
    from planegrasp.io.foxglove.channels import Channels
    from planegrasp.io.foxglove.config import FoxgloveConfig
    from planegrasp.io.messages.header import Header
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.viz.palette import RGB

__all__ = ["Pictures"]


class Pictures:
    """Logs frames; images that nobody takes are not made."""

    def __init__(
        self, channels: Channels, config: FoxgloveConfig, colors: Mapping[str, RGB]
    ) -> None:
        self._channels, self._config, self._colors = channels, config, colors
        self._undistorted: Undistorted | None = None
        self._rate = PictureRate(config.image_rate)

    def log(self, header: Header, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Log a frame and what is detected in it.

        Colour comes last: whoever pairs it with depth need not wait for that.
        """
        channels, time = self._channels, header.stamp.total_nanoseconds
        channels.calibration.log(calibration(header, frame.camera), log_time=time)
        if channels.annotations.has_sinks():
            drawn = image_annotations(header, detections, frame.camera, self._colors)
            channels.annotations.log(drawn, log_time=time)
        if self._rate.is_due(header.stamp.to_seconds()):
            if frame.depth is not None and channels.depth.has_sinks():
                channels.depth.log(depth_image(header, frame.depth), log_time=time)
            self._log_cloud(header, frame)
            if channels.color.has_sinks():
                settings = self._config.color, self._config.jpeg_quality
                channels.log_color(color_image(header, frame.color, *settings), time)

    def _log_cloud(self, header: Header, frame: RGBDFrame) -> None:
        most, channel = self._config.cloud_points, self._channels.cloud
        if frame.depth is None or not most or not channel.has_sinks():
            return
        if self._undistorted is None or self._undistorted.camera != frame.camera:
            self._undistorted = Undistorted(frame.camera)
        depth, color = self._undistorted.depth(frame.depth), self._undistorted.image(frame.color)
        points = cloud(header, depth, color, frame.camera, most)
        channel.log(points, log_time=header.stamp.total_nanoseconds)
