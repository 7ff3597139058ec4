"""The messages of ROS 1 bags and ROS 2 recordings, one at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from planegrasp.errors import MissingExtraError, SourceError

try:
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag1 import ReaderError as Reader1Error
    from rosbags.rosbag2 import Reader as Reader2
    from rosbags.rosbag2 import ReaderError as Reader2Error
    from rosbags.typesys import Stores, get_typestore
except ImportError as error:
    raise MissingExtraError("recordings of ROS", "bags", str(error)) from error

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path

# The three messages that are read are the same in all distributions.
_ROS1 = get_typestore(Stores.ROS1_NOETIC)
_ROS2 = get_typestore(Stores.ROS2_HUMBLE)


def ros_type(name: str) -> Any:
    """The class of a message of ROS 2, for example of ``sensor_msgs/msg/Image``."""
    return _ROS2.types[name]


@dataclass(frozen=True, slots=True)
class RawMessage:
    """A message as it lies in the recording.

    Attributes:
        topic: name.
        stamp: when it was recorded [s].
        kind: type, for example ``sensor_msgs/msg/Image``.
        data: serialised.
        is_ros1: whether by ROS 1, else CDR.
    """

    topic: str
    stamp: float
    kind: str
    data: bytes
    is_ros1: bool

    def read(self) -> Any:
        """The message with its fields.

        Raises:
            SourceError: it is damaged.
        """
        package, name = self.kind.split("/")[0], self.kind.split("/")[-1]
        kind = f"{package}/msg/{name}"
        try:
            if self.is_ros1:
                return _ROS1.deserialize_ros1(self.data, kind)
            return _ROS2.deserialize_cdr(self.data, kind)
        except Exception as error:  # the generated code raises what its NumPy calls raise
            raise SourceError(f"a message of {self.topic} is damaged: {error}") from error


class RecordedMessage(Protocol):
    """A message of a recording, see `RawMessage`."""

    @property
    def topic(self) -> str:
        """Its name."""
        ...

    @property
    def stamp(self) -> float:
        """When it was recorded [s]."""
        ...

    def read(self) -> Any:
        """The message with its fields, as ROS names them.

        Raises:
            SourceError: it is damaged.
        """
        ...


class MessageFile(Protocol):
    """A recording of messages.

    Attributes:
        types: message type by topic.
        counts: number of messages by topic.
        cut_off: how far the recording goes where it was not finished, or "".
    """

    types: dict[str, str]
    counts: dict[str, int]
    cut_off: str

    def messages(self, topics: Collection[str]) -> Iterator[RecordedMessage]:
        """The messages of some topics, in the order of the recording.

        Raises:
            SourceError: the recording is damaged.
        """
        ...


class RosBag:
    """A `MessageFile` over a ROS 1 bag, or a ROS 2 recording with its metadata.yaml."""

    cut_off = ""

    def __init__(self, path: Path) -> None:
        """Read its table of contents.

        Raises:
            SourceError: it is damaged, or not indexed.
        """
        self._path = path
        self._is_ros1 = path.is_file() and path.suffix != ".db3"
        self.types: dict[str, str] = {}
        self.counts: dict[str, int] = {}
        with _errors(path), self._open() as reader:
            for connection in reader.connections:
                self.types[connection.topic] = connection.msgtype
                count = self.counts.get(connection.topic, 0)
                self.counts[connection.topic] = count + connection.msgcount

    def messages(self, topics: Collection[str]) -> Iterator[RawMessage]:
        """See `MessageFile.messages`."""
        with _errors(self._path), self._open() as reader:
            wanted = [c for c in reader.connections if c.topic in topics]
            for connection, nanoseconds, data in reader.messages(wanted):
                yield RawMessage(
                    connection.topic,
                    nanoseconds / 1e9,
                    connection.msgtype,
                    bytes(data),
                    self._is_ros1,
                )

    def _open(self) -> Any:
        return Reader1(self._path) if self._is_ros1 else Reader2(self._path)


class _errors:  # noqa: N801 - used like a function
    """Names the file in what the readers raise."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        if isinstance(error, (Reader1Error, Reader2Error)) and "not indexed" in str(error):
            raise SourceError(
                f"{self._path} was not closed when it was recorded: run `rosbag reindex` on it"
            ) from error
        if error is not None and _is_of_reader(error):
            raise SourceError(f"{self._path} is a damaged recording: {error}") from error


def _is_of_reader(error: BaseException) -> bool:
    import apsw

    kinds = (Reader1Error, Reader2Error, apsw.Error, OSError, ValueError, EOFError, AssertionError)
    return isinstance(error, kinds) and not isinstance(error, SourceError)
