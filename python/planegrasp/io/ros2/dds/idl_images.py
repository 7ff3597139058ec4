"""Messages of sensor_msgs as DDS types."""

# No `from __future__ import annotations`: cyclonedds reads the annotations when a class is made.

import struct
from dataclasses import dataclass, fields
from typing import Any, Self

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import array, float64, sequence, uint8, uint32

from planegrasp.io.ros2.dds.cdr import Members
from planegrasp.io.ros2.dds.idl_common import Header, numbers


@dataclass
@final
class _ImageHead(IdlStruct, typename="sensor_msgs::msg::dds_::ImageHead_"):
    """What comes before the data of an Image."""

    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32


@dataclass
@final
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::Image_"):
    """sensor_msgs/Image."""

    header: Header
    height: uint32
    width: uint32
    encoding: str
    is_bigendian: uint8
    step: uint32
    data: sequence[uint8]

    def __post_init__(self) -> None:
        self.data = _raw(self.data)

    def serialize(
        self, buffer: Any = None, endianness: Any = None, use_version_2: bool | None = None
    ) -> bytes:
        """See `IdlStruct.serialize`; always little-endian."""
        return _with_bytes(self, _ImageHead)

    @classmethod
    def deserialize(
        cls, data: bytes, has_header: bool = True, use_version_2: bool | None = None
    ) -> Self:
        """See `IdlStruct.deserialize`; `data` of the message views them."""
        members: Any = Members(data)
        header, (height, width) = members.header(), members.numbers("II")
        encoding, is_bigendian = members.text(), members.byte()
        (step,) = members.numbers("I")
        return cls(header, height, width, encoding, is_bigendian, step, members.bytes())


@dataclass
@final
class _CompressedImageHead(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImageHead_"):
    """What comes before the data of a CompressedImage."""

    header: Header
    format: str


@dataclass
@final
class CompressedImage(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImage_"):
    """sensor_msgs/CompressedImage."""

    header: Header
    format: str
    data: sequence[uint8]

    def __post_init__(self) -> None:
        self.data = _raw(self.data)

    def serialize(
        self, buffer: Any = None, endianness: Any = None, use_version_2: bool | None = None
    ) -> bytes:
        """See `IdlStruct.serialize`; always little-endian."""
        return _with_bytes(self, _CompressedImageHead)

    @classmethod
    def deserialize(
        cls, data: bytes, has_header: bool = True, use_version_2: bool | None = None
    ) -> Self:
        """See `IdlStruct.deserialize`; `data` of the message views them."""
        members: Any = Members(data)
        return cls(members.header(), members.text(), members.bytes())


@dataclass
@final
class RegionOfInterest(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    """sensor_msgs/RegionOfInterest."""

    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
@final
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    """sensor_msgs/CameraInfo."""

    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: RegionOfInterest

    def __post_init__(self) -> None:
        self.d, self.k = numbers(self.d), numbers(self.k)
        self.r, self.p = numbers(self.r), numbers(self.p)

    @classmethod
    def deserialize(
        cls, data: bytes, has_header: bool = True, use_version_2: bool | None = None
    ) -> Self:
        """See `IdlStruct.deserialize`."""
        members: Any = Members(data)
        header, (height, width), model = members.header(), members.numbers("II"), members.text()
        (coefficients,) = members.numbers("I")
        d, k, r, p = (members.doubles(count) for count in (coefficients, 9, 9, 12))
        along_x, along_y = members.numbers("II")
        left, top, rows, columns = members.numbers("IIII")
        roi = RegionOfInterest(left, top, rows, columns, bool(members.byte()))
        return cls(header, height, width, model, d, k, r, p, along_x, along_y, roi)


# cyclonedds takes sequences of numbers one number at a time, which takes 31 ms for an image. So
# `data`, the last member, is written in one piece here.


def _with_bytes(message: Any, head: Any) -> bytes:
    """Serialise a message whose `data` follows the members of `head`."""
    begin = _aligned(head(*(getattr(message, field.name) for field in fields(head))).serialize())
    return b"".join((begin, struct.pack("<I", len(message.data)), message.data))


def _raw(data: Any) -> Any:
    return data if isinstance(data, bytes | memoryview) else bytes(data)


def _aligned(data: bytes) -> bytes:
    return data.ljust(-(-len(data) // 4) * 4, b"\0")
