"""planegrasp's `Transport` by rclpy: messages and topics are those of the ROS that is installed."""

from __future__ import annotations

import array
import threading
import time
from collections import deque
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosidl_runtime_py.utilities import get_message

from planegrasp.closing import ClosesAtEnd
from planegrasp.io.ros2 import Published
from planegrasp.io.ros2.names import check_topic
from planegrasp.io.ros2.profiles import DEFAULT, Profile

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from rclpy.node import Node

__all__ = ["RclpyReader", "RclpyTransport", "RclpyWriter", "ros_type"]

# What rclpy takes for sequences of numbers is an array.array of the right kind.
_CODES = {"sequence<uint8>": "B", "sequence<double>": "d"}
_WAITING = 100  # messages of a topic that wait to be taken


@cache
def ros_type(name: str) -> Callable[..., Any]:
    """What makes messages of a type, for example ``geometry_msgs/msg/Pose``, by their members."""
    kind = get_message(name)
    members = kind.get_fields_and_field_types()

    def make(**given: Any) -> Any:
        return kind(**{name: _fitting(value, members[name]) for name, value in given.items()})

    return make


def _fitting(value: Any, kind: str) -> Any:
    if kind in _CODES and isinstance(value, np.ndarray):
        whole = array.array(_CODES[kind])
        whole.frombytes(np.ascontiguousarray(value, dtype=_CODES[kind]).tobytes())
        return whole
    if kind == "octet":
        return bytes([value])
    return value


class RclpyTransport(ClosesAtEnd):
    """A `Transport` by a node of rclpy, which somebody else spins.

    Attributes:
        where: see `Transport`.
    """

    types = staticmethod(ros_type)

    def __init__(self, node: Node) -> None:
        self.where = "ROS"
        self._node = node
        self._came = threading.Condition()
        self._children: list[RclpyReader | RclpyWriter] = []

    def writer(self, topic: str, message: str, profile: Profile = DEFAULT) -> RclpyWriter:
        """See `Transport.writer`."""
        writer = RclpyWriter(self._node, check_topic(topic), message, profile)
        self._children.append(writer)
        return writer

    def reader(self, topic: str, message: str, profile: Profile = DEFAULT) -> RclpyReader:
        """See `Transport.reader`."""
        reader = RclpyReader(self._node, self._came, check_topic(topic), message, profile)
        self._children.append(reader)
        return reader

    def waiting(self, readers: Sequence[RclpyReader]) -> RclpyWaiting:
        """See `Transport.waiting`."""
        return RclpyWaiting(self._came, readers)

    def published(self) -> dict[str, Published]:
        """See `Transport.published`."""
        own = (self._node.get_name(), self._node.get_namespace())
        found = {}
        for topic, (kind, *_) in self._node.get_topic_names_and_types():
            others = [
                info
                for info in self._node.get_publishers_info_by_topic(topic)
                if (info.node_name, info.node_namespace) != own
            ]
            if others:
                reliable = ReliabilityPolicy.RELIABLE
                all_are = all(info.qos_profile.reliability == reliable for info in others)
                found[topic] = Published(kind, all_are)
        return found

    def close(self) -> None:
        """End all writers and readers; the node stays."""
        for child in self._children:
            child.close()
        self._children.clear()


class RclpyWriter:
    """A `Writer`; made by `RclpyTransport.writer`.

    Attributes:
        topic: its name.
        refused: 0: the middleware decides.
    """

    refused = 0

    def __init__(self, node: Node, topic: str, message: str, profile: Profile) -> None:
        self.topic = topic
        self._node = node
        self._keeps = profile.keeps
        self._publisher = node.create_publisher(get_message(message), topic, _qos(profile))

    @property
    def is_wanted(self) -> bool:
        """See `Writer.is_wanted`."""
        return self._keeps or self._publisher.get_subscription_count() > 0

    def write(self, message: Any) -> bool:
        """See `Writer.write`."""
        self._publisher.publish(message)
        return True

    def close(self) -> None:
        """See `Writer.close`."""
        if self._publisher is not None:
            self._node.destroy_publisher(self._publisher)
            self._publisher = None


class RclpyReader:
    """A `Reader`; made by `RclpyTransport.reader`.

    rclpy does not say who published a message: all count as one.

    Attributes:
        topic: its name.
    """

    def __init__(
        self, node: Node, came: threading.Condition, topic: str, message: str, profile: Profile
    ) -> None:
        self.topic = topic
        self._node = node
        self._came = came
        self._messages: deque[Any] = deque(maxlen=_WAITING)
        self._subscription = node.create_subscription(
            get_message(message), topic, self._take_in, _qos(profile)
        )

    @property
    def publishers(self) -> int:
        """See `Reader.publishers`."""
        return int(self._node.count_publishers(self.topic))

    @property
    def has_messages(self) -> bool:
        """Whether something came that was not taken."""
        return bool(self._messages)

    def take(self) -> list[tuple[Any, int]]:
        """See `Reader.take`."""
        with self._came:
            taken = [(message, 0) for message in self._messages]
            self._messages.clear()
        return taken

    def publisher_is_there(self, number: int) -> bool:
        """See `Reader.publisher_is_there`."""
        return self.publishers > 0

    def close(self) -> None:
        """See `Reader.close`."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def _take_in(self, message: Any) -> None:
        with self._came:
            self._messages.append(message)
            self._came.notify_all()


class RclpyWaiting:
    """A `Waiting`; made by `RclpyTransport.waiting`."""

    def __init__(self, came: threading.Condition, readers: Sequence[RclpyReader]) -> None:
        self._came = came
        self._readers = tuple(readers)

    def wait(self, seconds: float) -> bool:
        """See `Waiting.wait`."""
        end = time.monotonic() + seconds
        with self._came:
            while not any(reader.has_messages for reader in self._readers):
                left = end - time.monotonic()
                if left <= 0 or not self._readers:
                    return False
                self._came.wait(left)
        return True

    def close(self) -> None:
        """Nothing is held."""
        self._readers = ()


def _qos(profile: Profile) -> QoSProfile:
    return QoSProfile(
        depth=profile.depth,
        history=HistoryPolicy.KEEP_LAST,
        reliability=(
            ReliabilityPolicy.RELIABLE if profile.reliable else ReliabilityPolicy.BEST_EFFORT
        ),
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if profile.keeps else DurabilityPolicy.VOLATILE
        ),
    )
