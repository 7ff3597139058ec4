"""Recording into an MCAP file with sensor_msgs, as ROS 2 plays and Foxglove shows it."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.errors import MissingExtraError, RecordingError
from planegrasp.io.messages.header import Header, Stamp
from planegrasp.io.recording.base import Recorder, whole_millimetres
from planegrasp.io.ros2.conversions import camera_info_message, image_message

try:
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore
except ImportError as error:
    raise MissingExtraError("MCAP recordings", "bags", str(error)) from error

if TYPE_CHECKING:
    from pathlib import Path

    from planegrasp.rgbd import RGBDFrame

COLOR_TOPIC = "/camera/color/image_raw"
INFO_TOPIC = "/camera/color/camera_info"
DEPTH_TOPIC = "/camera/aligned_depth_to_color/image_raw"
OPTICAL_FRAME = "camera_color_optical_frame"

_TYPES = get_typestore(Stores.ROS2_HUMBLE)
_type = _TYPES.types.__getitem__
_IMAGE, _INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"


class McapRecorder(Recorder):
    """Writes an MCAP file; each message is a compressed chunk that is flushed with its frame.

    Colour is rgb8. Depth is 16UC1 where that keeps it exactly (whole millimetres), else 32FC1. The
    camera may change from frame to frame.
    """

    def __init__(self, path: Path) -> None:
        """Begin a file.

        Raises:
            RecordingError: the file cannot be made.
        """
        super().__init__(path)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = path.open("wb")
            # One message a chunk: what is complete can be read, whatever happens after it.
            self._writer = Writer(self._stream, chunk_size=1)
            self._writer.start(profile="ros2", library="planegrasp")
            self._channels = {
                topic: self._writer.register_channel(topic, "cdr", schema)
                for kind, topics in ((_IMAGE, (COLOR_TOPIC, DEPTH_TOPIC)), (_INFO, (INFO_TOPIC,)))
                for schema in [self._schema(kind)]
                for topic in topics
            }
            self._stream.flush()
        except OSError as error:
            raise RecordingError(f"{path} cannot be written: {error.strerror}") from error

    def _schema(self, kind: str) -> int:
        definition, _ = _TYPES.generate_msgdef(kind, ros_version=2)
        return int(self._writer.register_schema(kind, "ros2msg", definition.encode()))

    def _write(self, frame: RGBDFrame, stamp: float) -> None:
        nanoseconds = max(0, round(stamp * 1e9))
        header = Header(Stamp.from_nanoseconds(nanoseconds), OPTICAL_FRAME)
        info = camera_info_message(_type, header, frame.camera)
        self._add(INFO_TOPIC, info, _INFO, nanoseconds)
        if frame.depth is not None:
            depth, encoding = frame.depth, "32FC1"
            if whole_millimetres(depth):
                depth, encoding = np.rint(depth * 1000.0).astype(np.uint16), "16UC1"
            self._add(
                DEPTH_TOPIC, image_message(_type, header, depth, encoding), _IMAGE, nanoseconds
            )
        self._add(
            COLOR_TOPIC, image_message(_type, header, frame.color, "rgb8"), _IMAGE, nanoseconds
        )
        self._stream.flush()

    def _add(self, topic: str, message: Any, kind: str, nanoseconds: int) -> None:
        data = bytes(_TYPES.serialize_cdr(message, kind))
        self._writer.add_message(self._channels[topic], nanoseconds, data, nanoseconds)

    def _finish(self) -> None:
        if not self._stream.closed:
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._stream.close()

    def _give_up(self) -> None:
        with suppress(OSError):  # what is left in the buffer does not fit either
            self._stream.close()
