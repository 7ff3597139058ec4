"""What publishes and subscribes: DDS by itself, or ROS where it is installed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from planegrasp.io.ros2.profiles import DEFAULT, Profile

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["MessageTypes", "Published", "Reader", "Transport", "Waiting", "Writer"]


class MessageTypes(Protocol):
    """Gives the class of a message, which takes its members by name."""

    def __call__(self, name: str, /) -> Any:
        """The class of, for example, ``geometry_msgs/msg/Pose``."""
        ...


@dataclass(frozen=True, slots=True)
class Published:
    """What is published on a topic.

    Attributes:
        message: its type, for example ``sensor_msgs/msg/Image``.
        reliable: whether all who publish it send again what was lost.
    """

    message: str
    reliable: bool


class Writer(Protocol):
    """Publishes on one topic."""

    @property
    def refused(self) -> int:
        """Messages that found no room, because a reader did not keep up."""
        ...

    @property
    def is_wanted(self) -> bool:
        """Whether anybody reads it, or may do so later and get what was written before."""
        ...

    def write(self, message: Any) -> bool:
        """Publish, unless there is no room at once; then it is counted and False."""
        ...

    def close(self) -> None:
        """End it."""
        ...


class Reader(Protocol):
    """Takes messages of one topic.

    Attributes:
        topic: its name.
    """

    topic: str

    @property
    def publishers(self) -> int:
        """How many publish on the topic at present."""
        ...

    def take(self) -> list[tuple[Any, int]]:
        """What has come, oldest first: each message with a number of who published it."""
        ...

    def publisher_is_there(self, number: int) -> bool:
        """Whether who published a message still does."""
        ...

    def close(self) -> None:
        """End it."""
        ...


class Waiting(Protocol):
    """Waits for messages of several readers."""

    def wait(self, seconds: float) -> bool:
        """Whether something came within so long [s]."""
        ...

    def close(self) -> None:
        """End it; before the readers."""
        ...


class Transport(Protocol):
    """Takes part in ROS 2.

    Attributes:
        where: what it is part of, for messages, for example "domain 0".
    """

    where: str

    @property
    def types(self) -> MessageTypes:
        """Of the messages that it writes."""
        ...

    def writer(self, topic: str, message: str, profile: Profile = DEFAULT) -> Writer:
        """Something to publish with.

        Args:
            topic: for example ``/planegrasp/detections``.
            message: its type, for example ``vision_msgs/msg/Detection3DArray``.
            profile: quality of service.

        Raises:
            InvalidInputError: the topic's name is none for ROS, or there is no such message.
        """
        ...

    def reader(self, topic: str, message: str, profile: Profile = DEFAULT) -> Reader:
        """Something to subscribe with; arguments and errors as of `writer`."""
        ...

    def waiting(self, readers: Sequence[Reader]) -> Waiting:
        """Something to wait with for messages of these readers."""
        ...

    def published(self) -> Mapping[str, Published]:
        """What others publish at present, by topic."""
        ...

    def close(self) -> None:
        """Leave; writers and readers end, too."""
        ...
