"""Messages with Foxglove's schemas (protobuf), as the ROS messages that say the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.errors import InvalidInputError, MissingExtraError, SourceError
from planegrasp.io.messages.header import Header, Stamp
from planegrasp.io.ros2.conversions import header_message
from planegrasp.io.sources.ros_messages import ros_type

try:
    from google.protobuf.message import DecodeError
    from mcap.exceptions import McapError
    from mcap_protobuf.decoder import DecoderFactory
except ImportError as error:
    raise MissingExtraError("MCAP recordings", "bags", str(error)) from error

if TYPE_CHECKING:
    from collections.abc import Callable

    from mcap.records import Schema

__all__ = ["FOXGLOVE_TYPES", "PROTOBUF", "FoxgloveMessage", "FoxgloveTypes"]

PROTOBUF = "protobuf"  # the only encoding of these messages that is read


class FoxgloveTypes:
    """Decodes the messages of one file by the schemas in it."""

    def __init__(self) -> None:
        self._factory = DecoderFactory()

    def decoder(self, encoding: str, schema: Schema) -> Callable[[bytes], Any] | None:
        """What decodes a message; None where it is none of Foxglove's, or not in protobuf.

        Raises:
            SourceError: the schema is damaged.
        """
        if schema.name not in _CONVERSIONS:
            return None
        try:
            return self._factory.decoder_for(encoding, schema)
        except (McapError, DecodeError, TypeError, KeyError) as error:
            raise SourceError(f"the schema {schema.name} is damaged: {error}") from error


@dataclass(frozen=True, slots=True)
class FoxgloveMessage:
    """A message as it lies in the recording; see `RawMessage`, whose place it takes.

    Attributes:
        topic: name.
        stamp: when it was recorded [s].
        kind: name of the schema.
        data: serialised.
        decode: by the schema of the file.
    """

    topic: str
    stamp: float
    kind: str
    data: bytes
    decode: Callable[[bytes], Any]

    def read(self) -> Any:
        """The message of ROS that says the same.

        Raises:
            SourceError: it is damaged.
        """
        try:
            return _CONVERSIONS[self.kind](self.decode(self.data))
        except (DecodeError, AttributeError, InvalidInputError) as error:
            raise SourceError(f"a message of {self.topic} is damaged: {error}") from error


def _image(message: Any) -> Any:
    return ros_type("sensor_msgs/msg/Image")(
        header=_header(message),
        height=message.height,
        width=message.width,
        encoding=message.encoding,
        is_bigendian=0,
        step=message.step,
        data=np.frombuffer(message.data, np.uint8),
    )


def _compressed(message: Any) -> Any:
    return ros_type("sensor_msgs/msg/CompressedImage")(
        header=_header(message),
        format=message.format,
        data=np.frombuffer(message.data, np.uint8),
    )


def _calibration(message: Any) -> Any:
    whole = ros_type("sensor_msgs/msg/RegionOfInterest")(
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    return ros_type("sensor_msgs/msg/CameraInfo")(
        header=_header(message),
        height=message.height,
        width=message.width,
        distortion_model=message.distortion_model,
        d=np.array(message.D),
        # What a camera leaves out is unknown, as 0 is with ROS.
        k=np.array(message.K or np.zeros(9)),
        r=np.array(message.R or np.zeros(9)),
        p=np.array(message.P or np.zeros(12)),
        binning_x=0,
        binning_y=0,
        roi=whole,
    )


def _header(message: Any) -> Any:
    stamp = Stamp(message.timestamp.seconds, message.timestamp.nanos)
    return header_message(ros_type, Header(stamp, message.frame_id))


_CONVERSIONS: dict[str, Callable[[Any], Any]] = {
    "foxglove.RawImage": _image,
    "foxglove.CompressedImage": _compressed,
    "foxglove.CameraCalibration": _calibration,
}
FOXGLOVE_TYPES = frozenset(_CONVERSIONS)
