"""What decoded messages of a log say."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.io.messages import Stamp


def stamp_of(message):
    return Stamp(message.timestamp.seconds, message.timestamp.nanos)


def matrix(message):
    """4×4 of a protobuf pose."""
    p, q = message.position, message.orientation
    T = RigidTransform.from_components([p.x, p.y, p.z], rotation(q))
    return T.as_matrix()


def rotation(q):
    return Rotation.from_quat([q.x, q.y, q.z, q.w])


def assert_equal(document, message):
    """The JSON says what the message says, member for member, nothing more."""
    if is_dataclass(message):
        assert list(document) == [one.name for one in fields(message)]
        for one in fields(message):
            assert_equal(document[one.name], getattr(message, one.name))
    elif isinstance(message, tuple):
        for item, value in zip(document, message, strict=True):
            if not isinstance(value, tuple):
                assert_equal(item, value)
            elif isinstance(value[0], str):
                assert (item["name"], item["value"]) == value
            else:
                assert tuple(item["values"]) == value
    else:
        assert document == message
