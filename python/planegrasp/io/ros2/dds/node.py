"""A participant of a DDS domain, with writers and readers that ROS 2 takes for its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import NetworkError
from planegrasp.io.ros2.dds import _dependencies  # noqa: F401
from planegrasp.io.ros2.dds.config import DdsConfig
from planegrasp.io.ros2.dds.interfaces import interfaces
from planegrasp.io.ros2.dds.qos import reader_qos, writer_qos
from planegrasp.io.ros2.dds.types import dds_type, ros_name
from planegrasp.io.ros2.names import dds_topic, ros_topic
from planegrasp.io.ros2.profiles import DEFAULT, Profile
from planegrasp.io.ros2.transport import Published

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
    from collections.abc import Sequence

    from planegrasp.io.ros2.transport import MessageTypes, Reader

__all__ = ["DdsNode", "DdsReader", "DdsWaiting", "DdsWriter"]

_MOST_ENDPOINTS = 10_000
_MOST_SAMPLES = 100


class DdsNode(ClosesAtEnd):
    """A `Transport` without a ROS installation.

    One process has one configuration for a domain: further nodes of it share that of the first,
    which must be closed last.

    Attributes:
        config: as given.
        where: see `Transport`.
    """

    def __init__(self, config: DdsConfig | None = None) -> None:
        """Enter the domain.

        Raises:
            NetworkError: there is no such network interface, or none that can be used; or DDS gives
                another reason, which the message has.
        """
        self.config = config or DdsConfig()
        self.where = f"domain {self.config.domain}"
        self._domain: Domain | None = None
        self._children: list[DdsReader | DdsWriter] = []
        xml, network = self.config.xml, self.config.network
        try:
            if network not in ("", "auto", *interfaces()):
                raise DDSException(DDSException.DDS_RETCODE_BAD_PARAMETER)
            if xml is not None:
                self._domain = _domain(self.config.domain, xml)
            self._participant: Any = DomainParticipant(self.config.domain)
        except DDSException as error:
            self._domain = None
            raise NetworkError(_no_network(self.config, error)) from error
        self._endpoints: Any = BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)

    @property
    def types(self) -> MessageTypes:
        """See `Transport.types`."""
        return dds_type

    def writer(self, topic: str, message: str, profile: Profile = DEFAULT) -> DdsWriter:
        """See `Transport.writer`."""
        writer = DdsWriter(self._participant, topic, message, profile)
        self._children.append(writer)
        return writer

    def reader(self, topic: str, message: str, profile: Profile = DEFAULT) -> DdsReader:
        """See `Transport.reader`."""
        reader = DdsReader(self._participant, topic, message, profile)
        self._children.append(reader)
        return reader

    def waiting(self, readers: Sequence[Reader]) -> DdsWaiting:
        """See `Transport.waiting`; the readers are of this node."""
        own = [reader for reader in readers if isinstance(reader, DdsReader)]
        return DdsWaiting(self._participant, own)

    def published(self) -> dict[str, Published]:
        """See `Transport.published`."""
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


class DdsWriter:
    """A `Writer`; made by `DdsNode.writer`.

    Attributes:
        topic: its name in ROS.
        refused: messages that found no room, because a reader did not keep up.
    """

    def __init__(self, participant: Any, topic: str, message: str, profile: Profile) -> None:
        self.topic = topic
        self.refused = 0
        inner = Topic(participant, dds_topic(topic), dds_type(message))
        self._writer: Any = DataWriter(participant, inner, writer_qos(profile))
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


class DdsReader:
    """A `Reader`; made by `DdsNode.reader`.

    Attributes:
        topic: its name in ROS.
    """

    def __init__(self, participant: Any, topic: str, message: str, profile: Profile) -> None:
        self.topic = topic
        inner = Topic(participant, dds_topic(topic), dds_type(message))
        self._reader: Any = DataReader(participant, inner, reader_qos(profile))
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


class DdsWaiting:
    """A `Waiting`; made by `DdsNode.waiting`."""

    def __init__(self, participant: Any, readers: Sequence[DdsReader]) -> None:
        self._set: Any = WaitSet(participant)
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


def _no_network(config: DdsConfig, error: DDSException) -> str:
    """Why a domain cannot be entered, and what would help."""
    names = {"": "the loopback interface", "auto": "any network interface"}
    wanted = names.get(config.network, f"the network interface {config.network!r}")
    cannot = f"DDS cannot use {wanted} in domain {config.domain}"
    up = interfaces()
    is_up = {"": any(name.startswith("lo") for name in up), "auto": bool(up)}
    if is_up.get(config.network, config.network in up):
        given = "" if config.xml else ", with the configuration that CYCLONEDDS_URI names"
        return f"{cannot}{given}: {error}"
    help_ = (
        f"name one that is up ({', '.join(up)})"
        if up
        else "none is up, not even lo (ip link set lo up)"
    )
    here = ", or none to stay on this computer" if up and config.network else ""
    return f"{cannot}: {help_}{here}"
