"""Choosing a driver by name."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError, SourceError

if TYPE_CHECKING:
    from planegrasp.geometry import PinholeCamera
    from planegrasp.io.cameras.base import Camera
    from planegrasp.io.ros2 import Transport
    from planegrasp.io.sources import RecordingTopics

DRIVERS = ("realsense", "opencv", "openni", "ros2")
"""What a camera's name starts with."""


def is_camera_name(text: str) -> bool:
    """Whether a source is named as a camera; a file of such a name is opened as ``./NAME``."""
    return text.split(":", 1)[0] in DRIVERS


def open_camera(
    name: str,
    *,
    camera: PinholeCamera | str | Path | None = None,
    field_of_view: float | None = None,
    width: int | None = None,
    height: int | None = None,
    frames_per_second: int | None = None,
    depth_scale: float | None = None,
    topics: RecordingTopics | None = None,
    node: Transport | None = None,
) -> Camera:
    """The camera of that name, which starts when `NewestFrame` or its `open` does so.

    ======================  ====================================================================
    ``realsense[:SERIAL]``  colour and aligned depth of a RealSense; needs the extra `realsense`
    ``openni[:URI]``        Kinect-class sensors through OpenNI2; needs the extra `openni`
    ``opencv:NUMBER|URL``   any camera or stream that OpenCV opens; without depth
    ``ros2[:TOPIC]``        colour image and what belongs to it of a ROS 2 driver, without a ROS
                            installation (docs/ros2.md); needs the extra `ros2`
    ======================  ====================================================================

    Args:
        name: of the driver and the device; without a device the first one is taken.
        camera: intrinsics of the colour image, or a camera file, instead of the device's own.
        field_of_view: horizontal [rad], for cameras that do not know their intrinsics.
        width: of the images [px]; by default the driver's choice, 640×480 where it has to be told.
        height: of the images [px].
        frames_per_second: by default the driver's choice, 30 where it has to be told.
        depth_scale: metres per unit of 16-bit depth of ROS; millimetres by default.
        node: participant in DDS to read topics of ROS with; by default one of its own, where the
            environment says (`DdsConfig.from_environment`).
        topics: of depth and camera_info in ROS, where the choice by name is not the right one.

    Raises:
        InvalidInputError: no driver has that name, or an option has no sensible value.
        MissingExtraError: what the driver needs is not installed.
        SourceError, CameraError: the camera file is none.
    """
    from planegrasp.io.camera_file import read_camera
    from planegrasp.io.cameras.mode import StreamMode

    driver, _, device = name.partition(":")
    if camera is not None and field_of_view is not None:
        raise SourceError("give a camera or a field of view, not both")
    if field_of_view is not None and not 0.0 < field_of_view < math.pi:
        raise InvalidInputError(
            f"the field of view must lie between 0° and 180°, "
            f"got {math.degrees(field_of_view):.6g}°"
        )
    mode = StreamMode(width, height, frames_per_second)
    intrinsics = read_camera(camera)[0] if isinstance(camera, (str, Path)) else camera
    if driver != "ros2" and not (topics is None and depth_scale is None):
        raise InvalidInputError(
            f"topics and a depth scale are for ROS and for recordings, {name} is a camera"
        )
    if driver == "opencv":
        from planegrasp.io.cameras.opencv import OpenCVCamera

        return OpenCVCamera(device or "0", intrinsics, field_of_view, mode)
    if driver == "realsense":
        if field_of_view is not None:
            raise InvalidInputError("a RealSense knows its intrinsics: give no field of view")
        from planegrasp.io.cameras.realsense import RealSenseCamera

        return RealSenseCamera(device, intrinsics, mode)
    if driver == "openni":
        from planegrasp.io.cameras.openni import OpenNICamera

        return OpenNICamera(device, intrinsics, field_of_view, mode)
    if driver == "ros2":
        if field_of_view is not None or mode != StreamMode():
            raise InvalidInputError(
                "camera_info says what there is to know of images of ROS: give no field of view, "
                "size or rate"
            )
        if node is None:
            from planegrasp.io.ros2.dds import _dependencies  # noqa: F401 - says what is missing
        from planegrasp.io.cameras.ros2 import Ros2Camera

        return Ros2Camera(device, topics, intrinsics, depth_scale, node)
    raise InvalidInputError(
        f"no camera is named {name!r}: expected realsense, realsense:SERIAL, openni, "
        f"opencv:0, opencv:rtsp://… or ros2:/TOPIC"
    )
