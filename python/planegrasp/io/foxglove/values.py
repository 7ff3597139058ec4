"""Stamps, poses and colours as Foxglove's messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foxglove.messages import Color, FrameTransform, Point2, Point3, Quaternion, Timestamp, Vector3
from foxglove.messages import Pose as PoseMessage

from planegrasp.io.messages.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np
    from numpy.typing import NDArray

    from planegrasp.io.messages.header import Header, Stamp
    from planegrasp.io.messages.pose import Triple
    from planegrasp.viz.palette import RGB

__all__ = [
    "IDENTITY",
    "color_message",
    "pixels",
    "points",
    "pose_message",
    "timestamp",
    "transform",
    "vector",
]

IDENTITY = Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
"""A frame in itself."""


def timestamp(stamp: Stamp) -> Timestamp:
    """A point in time."""
    return Timestamp(stamp.seconds, stamp.nanoseconds)


def vector(values: Triple) -> Vector3:
    """Three numbers."""
    x, y, z = values
    return Vector3(x=x, y=y, z=z)


def pose_message(pose: Pose) -> PoseMessage:
    """A pose in the frame that the message names beside it."""
    return PoseMessage(position=vector(pose.position), orientation=_quaternion(pose))


def transform(header: Header, child: str, pose: Pose) -> FrameTransform:
    """The pose of a child frame in the header's frame."""
    return FrameTransform(
        timestamp=timestamp(header.stamp),
        parent_frame_id=header.frame_id,
        child_frame_id=child,
        translation=vector(pose.position),
        rotation=_quaternion(pose),
    )


def color_message(rgb: RGB, alpha: float = 1.0) -> Color:
    """A colour, of which 0 … 255 become 0 … 1."""
    r, g, b = (value / 255 for value in rgb)
    return Color(r=r, g=g, b=b, a=alpha)


def pixels(rows: Iterable[NDArray[np.float64]]) -> list[Point2]:
    """N×2 pixels."""
    return [Point2(x=float(x), y=float(y)) for x, y in rows]


def points(rows: Iterable[Iterable[float]]) -> list[Point3]:
    """N×3 metres."""
    return [Point3(x=float(x), y=float(y), z=float(z)) for x, y, z in rows]


def _quaternion(pose: Pose) -> Quaternion:
    x, y, z, w = pose.orientation
    return Quaternion(x=x, y=y, z=z, w=w)
