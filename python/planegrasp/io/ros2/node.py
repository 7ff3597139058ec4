"""A participant of a DDS domain, with writers and readers that ROS 2 takes for its own."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import InvalidInputError, NetworkError
from planegrasp.io.ros2 import _dependencies  # noqa: F401
from planegrasp.io.ros2.names import dds_topic, ros_topic
from planegrasp.io.ros2.qos import DEFAULT, Profile
from planegrasp.io.ros2.types import dds_type, ros_name

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication  # isort: skip
from cyclonedds.core import (  # isort: skip
    DDSException,
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant  # isort: skip
from cyclonedds.qos import Policy  # isort: skip
from cyclonedds.pub import DataWriter  # isort: skip
from cyclonedds.sub import DataReader  # isort: skip
from cyclonedds.topic import Topic  # isort: skip

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["DdsConfig", "DdsNode", "Published", "Reader", "Waiting", "Writer"]

_LARGEST_DOMAIN = 232
_MOST_ENDPOINTS = 10_000
_MOST_SAMPLES = 100
# A reader that does not keep up or was killed must not hold a writer up: there is room for what it
# has not got. What is older than the depth of a topic's history goes anyway.
_ROOM = "64 MB"


@dataclass(frozen=True, slots=True)
class DdsConfig:
    """Which DDS domain, on which network.

    Attributes:
        domain: number of the domain, 0 … 232; the others on the same network have the same
            (`ROS_DOMAIN_ID`).
        network: "" keeps everything on this computer (the loopback interface); "auto" takes the
            network interface that Cyclone DDS chooses, or all that `CYCLONEDDS_URI` configures;
            else the name of one, for example "eth0".

    Raises:
        InvalidInputError: the domain is out of range, or the network no name.
    """

    domain: int = 0
    network: str = ""

    def __post_init__(self) -> None:
        if not 0 <= self.domain <= _LARGEST_DOMAIN:
            raise InvalidInputError(
                f"the number of a domain is 0 … {_LARGEST_DOMAIN}, got {self.domain}"
            )
        if any(character in self.network for character in "<>&\"'/ "):
            raise InvalidInputError(f"no network interface is named {self.network!r}")

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] | None = None) -> Self:
        """As ROS 2 would have it by `ROS_DOMAIN_ID` and `ROS_AUTOMATIC_DISCOVERY_RANGE`.

        Only the range SUBNET, said in so many words, leads onto the network.

        Raises:
            InvalidInputError: `ROS_DOMAIN_ID` is no number of a domain.
        """
        variables = os.environ if environment is None else environment
        text = variables.get("ROS_DOMAIN_ID", "") or "0"
        if not text.isdecimal():
            raise InvalidInputError(f"ROS_DOMAIN_ID must be a number, got {text!r}")
        is_wide = variables.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "SUBNET"
        return cls(int(text), "auto" if is_wide else "")

    @property
    def xml(self) -> str | None:
        """Configuration of Cyclone DDS; None leaves it to `CYCLONEDDS_URI`."""
        if self.network == "auto" and os.environ.get("CYCLONEDDS_URI"):
            return None
        if self.network == "auto":
            interface, discovery, sizes = 'autodetermine="true"', "", ""
        elif self.network:
            interface, discovery, sizes = f'name="{self.network}"', "", ""
        else:
            # Linux' loopback can do multicast, but does not say so. Peers that do not use it there
            # are found by the ports of the first participants.
            interface = 'address="127.0.0.1" multicast="true"'
            # Its packets are large: images come through in few.
            sizes = "<MaxMessageSize>65000 B</MaxMessageSize><FragmentSize>60000 B</FragmentSize>"
            discovery = (
                "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
                "<MaxAutoParticipantIndex>99</MaxAutoParticipantIndex>"
                '<Peers><Peer address="127.0.0.1"/></Peers></Discovery>'
            )
        return (
            "<CycloneDDS><Domain><General><Interfaces>"
            f"<NetworkInterface {interface}/></Interfaces>{sizes}</General>{discovery}"
            f"<Internal><Watermarks><WhcHigh>{_ROOM}</WhcHigh></Watermarks></Internal>"
            "<Tracing><Verbosity>none</Verbosity></Tracing></Domain></CycloneDDS>"
        )


@dataclass(frozen=True, slots=True)
class Published:
    """What is published on a topic.

    Attributes:
        message: its type, for example ``sensor_msgs/msg/Image``.
        reliable: whether all who publish it send again what was lost.
    """

    message: str
    reliable: bool


class DdsNode(ClosesAtEnd):
    """Publishes and subscribes to ROS topics without a ROS installation.

    One process has one configuration for a domain: further nodes of it share that of the first,
    which must be closed last.

    Attributes:
        config: as given.
    """

    def __init__(self, config: DdsConfig | None = None) -> None:
        """Enter the domain.

        Raises:
            NetworkError: there is no such network interface, or none that can be used.
        """
        self.config = config or DdsConfig()
        self._domain: Domain | None = None
        self._children: list[Reader | Writer] = []
        xml, network = self.config.xml, self.config.network
        try:
            if network not in ("", "auto", *_interfaces()):
                raise DDSException(DDSException.DDS_RETCODE_BAD_PARAMETER, "there is none")
            if xml is not None:
                self._domain = _domain(self.config.domain, xml)
            self._participant: Any = DomainParticipant(self.config.domain)
        except DDSException as error:
            self._domain = None
            wanted = f"the network interface {network!r}" if network else "the loopback interface"
            raise NetworkError(
                f"DDS cannot use {wanted} in domain {self.config.domain}: {error.msg}; name one "
                f"that is up ({', '.join(_interfaces())}), or none to stay on this computer"
            ) from error
        self._endpoints: Any = BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)

    def writer(self, topic: str, message: str, profile: Profile = DEFAULT) -> Writer:
        """Something to publish with.

        Args:
            topic: for example ``/planegrasp/detections``.
            message: its type, for example ``vision_msgs/msg/Detection3DArray``.
            profile: quality of service.

        Raises:
            InvalidInputError: the topic's name is none for ROS, or there is no such message.
        """
        writer = Writer(self._participant, topic, message, profile)
        self._children.append(writer)
        return writer

    def reader(self, topic: str, message: str, profile: Profile = DEFAULT) -> Reader:
        """Something to subscribe with; arguments and errors as of `writer`."""
        reader = Reader(self._participant, topic, message, profile)
        self._children.append(reader)
        return reader

    def published(self) -> dict[str, Published]:
        """What others publish in the domain at present, by topic."""
        own = _unsigned(self._participant.get_instance_handle())
        alive = ReadCondition(
            self._endpoints, SampleState.Any | ViewState.Any | InstanceState.Alive
        )
        found: dict[str, Published] = {}
        for endpoint in self._endpoints.read(_MOST_ENDPOINTS, alive):
            topic = ros_topic(endpoint.topic_name)
            if topic is not None and _unsigned(endpoint.participant_instance_handle) != own:
                reliable = isinstance(endpoint.qos[Policy.Reliability], Policy.Reliability.Reliable)
                others = found.get(topic)
                found[topic] = Published(
                    ros_name(endpoint.type_name), reliable and (others is None or others.reliable)
                )
        return found

    def close(self) -> None:
        """Leave the domain; writers and readers end, too."""
        for child in self._children:
            child.close()
        self._children.clear()
        self._endpoints = None
        self._participant = None
        self._domain = None


class Writer:
    """Publishes on one topic; made by `DdsNode.writer`.

    Attributes:
        topic: its name in ROS.
        refused: messages that found no room, because a reader did not keep up.
    """

    def __init__(self, participant: Any, topic: str, message: str, profile: Profile) -> None:
        self.topic = topic
        self.refused = 0
        inner = Topic(participant, dds_topic(topic), dds_type(message))
        self._writer: Any = DataWriter(participant, inner, profile.of_writer())
        self._keeps = profile.keeps

    @property
    def is_wanted(self) -> bool:
        """Whether anybody reads it, or may do so later and get what was written before."""
        return self._keeps or bool(self._writer.get_matched_subscriptions())

    def write(self, message: Any) -> bool:
        """Publish, unless there is no room at once; then it is counted and False."""
        try:
            self._writer.write(message)
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise
            self.refused += 1
            return False
        return True

    def close(self) -> None:
        """End it."""
        self._writer = None


class Reader:
    """Takes messages of one topic; made by `DdsNode.reader`.

    Attributes:
        topic: its name in ROS.
    """

    def __init__(self, participant: Any, topic: str, message: str, profile: Profile) -> None:
        self.topic = topic
        inner = Topic(participant, dds_topic(topic), dds_type(message))
        self._reader: Any = DataReader(participant, inner, profile.of_reader())
        self._fresh: Any = ReadCondition(
            self._reader, SampleState.NotRead | ViewState.Any | InstanceState.Any
        )

    @property
    def publishers(self) -> int:
        """How many publish on the topic at present."""
        return len(self._reader.get_matched_publications())

    def take(self) -> list[tuple[Any, int]]:
        """What has come, oldest first: each message with a number of who published it."""
        samples = self._reader.take(_MOST_SAMPLES)
        return [
            (sample, _unsigned(sample.sample_info.publication_handle))
            for sample in samples
            if sample.sample_info.valid_data
        ]

    def publisher_is_there(self, number: int) -> bool:
        """Whether who published a message still does."""
        return number in map(_unsigned, self._reader.get_matched_publications())

    def close(self) -> None:
        """End it."""
        self._fresh = None
        self._reader = None


class Waiting:
    """Waits for messages of several readers."""

    def __init__(self, node: DdsNode, readers: Sequence[Reader]) -> None:
        self._set: Any = WaitSet(node._participant)
        for reader in readers:
            self._set.attach(reader._fresh)

    def wait(self, seconds: float) -> bool:
        """Whether something came within so long [s]."""
        return bool(self._set.wait(max(0, int(seconds * 1e9))))

    def close(self) -> None:
        """End it; before the readers."""
        self._set = None


def _domain(number: int, xml: str) -> Domain | None:
    """Configure a domain; None where this process has done so before."""
    try:
        return Domain(number, xml)
    except DDSException as error:
        if error.code == DDSException.DDS_RETCODE_PRECONDITION_NOT_MET:
            return None
        raise


def _unsigned(handle: int) -> int:
    """An instance handle, which cyclonedds gives with or without sign, depending on where."""
    return handle % 2**64


def _interfaces() -> list[str]:
    import socket

    return [name for _, name in socket.if_nameindex()]
