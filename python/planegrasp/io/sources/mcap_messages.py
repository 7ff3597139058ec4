"""The messages of MCAP files, also of such that were not finished."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, BinaryIO, cast

from planegrasp.errors import MissingExtraError, SourceError
from planegrasp.io.sources.foxglove_messages import (
    FOXGLOVE_TYPES,
    PROTOBUF,
    FoxgloveMessage,
    FoxgloveTypes,
)
from planegrasp.io.sources.ros_messages import RawMessage, RecordedMessage

try:
    from mcap.exceptions import EndOfFile, McapError
    from mcap.reader import SeekingReader
    from mcap.records import Channel, Message, Schema
    from mcap.stream_reader import CRCValidationError, StreamReader
    from zstandard import ZstdError
except ImportError as error:
    raise MissingExtraError("MCAP recordings", "bags", str(error)) from error

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence
    from pathlib import Path

    from mcap.summary import Summary

MCAP_MAGIC = b"\x89MCAP0\r\n"

_DAMAGE = (McapError, CRCValidationError, ZstdError, RuntimeError, struct.error, ValueError)
_ENCODINGS = {"cdr": False, "ros1": True}  # of messages; whether ROS 1


class McapFiles:
    """A `MessageFile` over one MCAP file, or over several that follow each other.

    A file that was not finished, because the recorder was killed or the file cut, is read up to its
    last complete message.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        """Read the tables of contents, or all of a file that has none.

        Raises:
            SourceError: a file is damaged.
        """
        self._paths = tuple(paths)
        self.types: dict[str, str] = {}
        self.counts: dict[str, int] = {}
        self.cut_off = ""
        for path in self._paths:
            summary = _summary(path)
            if summary is None or summary.statistics is None:
                self._scan(path)
                continue
            for channel in summary.channels.values():
                schema = summary.schemas.get(channel.schema_id)
                count = summary.statistics.channel_message_counts.get(channel.id, 0)
                self._add(channel, schema, count)

    def messages(self, topics: Collection[str]) -> Iterator[RecordedMessage]:
        """See `MessageFile.messages`."""
        for path in self._paths:
            types = FoxgloveTypes()
            for schema, channel, message in _Records(path):
                if channel.topic not in topics or schema is None:
                    continue
                stamp = message.log_time / 1e9
                is_ros1 = _ENCODINGS.get(channel.message_encoding)
                if is_ros1 is not None:
                    yield RawMessage(channel.topic, stamp, schema.name, message.data, is_ros1)
                    continue
                decode = types.decoder(channel.message_encoding, schema)
                if decode is None:
                    raise SourceError(
                        f"{path}: {channel.topic} has messages of {_type(channel, schema)}, which "
                        f"are not read"
                    )
                yield FoxgloveMessage(channel.topic, stamp, schema.name, message.data, decode)

    def _scan(self, path: Path) -> None:
        first: int | None = None
        last = 0
        records = _Records(path)
        for schema, channel, message in records:
            self._add(channel, schema, 1)
            first = message.log_time if first is None else first
            last = message.log_time
        if records.is_finished:
            return
        end = "it has no whole message"
        if first is not None:
            whole, rest = divmod(last, 10**9)
            end = f"it ends after {(last - first) / 1e9:.1f} s at log time {whole}.{rest:09d}"
        self.cut_off = (
            f"{path.name} was cut off when it was recorded: {end}, and is whole up to byte "
            f"{records.end} of {path.stat().st_size}"
        )

    def _add(self, channel: Channel, schema: Schema | None, count: int) -> None:
        self.types[channel.topic] = "" if schema is None else _type(channel, schema)
        self.counts[channel.topic] = self.counts.get(channel.topic, 0) + count


def _type(channel: Channel, schema: Schema) -> str:
    """The type of messages; one whose encoding is not read is no known type, and names it."""
    encoding = channel.message_encoding
    is_read = encoding == PROTOBUF if schema.name in FOXGLOVE_TYPES else encoding in _ENCODINGS
    return schema.name if is_read else f"{schema.name} as {encoding}"


class _Records:
    """All messages of a file; those of one that was not finished up to where it goes.

    Attributes:
        is_finished: whether the file ends as a finished one does.
        end: byte after the last complete record that was read.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.end = 0
        with path.open("rb") as stream:
            self.is_finished = _is_finished(stream)

    def __iter__(self) -> Iterator[tuple[Schema | None, Channel, Message]]:
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        with self._path.open("rb") as stream:
            try:
                exact = cast("BinaryIO", _Exact(stream))
                for record in StreamReader(exact, validate_crcs=True).records:
                    self.end = stream.tell()
                    if isinstance(record, Schema):
                        schemas[record.id] = record
                    elif isinstance(record, Channel):
                        channels[record.id] = record
                    elif isinstance(record, Message):
                        channel = channels[record.channel_id]
                        yield schemas.get(channel.schema_id), channel, record
            except (*_DAMAGE, KeyError) as error:
                if self.is_finished:
                    raise SourceError(f"{self._path} is a damaged MCAP file: {error!r}") from error


def _summary(path: Path) -> Summary | None:
    """The table of contents; None for a file that was not finished or has none."""
    with path.open("rb") as stream:
        if not _is_finished(stream):
            return None
        try:
            return SeekingReader(stream).get_summary()
        except _DAMAGE as error:
            raise SourceError(f"{path} is a damaged MCAP file: {error!r}") from error


class _Exact:
    """A stream that never gives less than it was asked for, as the reader takes for granted."""

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream

    def read(self, length: int) -> bytes:
        data = self._stream.read(length)
        if len(data) < length:
            raise EndOfFile
        return data


def _is_finished(stream: BinaryIO) -> bool:
    """Whether the file ends as a finished one does; the stream is at its start afterwards."""
    size = stream.seek(0, 2)
    stream.seek(max(0, size - len(MCAP_MAGIC)))
    finished = stream.read() == MCAP_MAGIC and size > 2 * len(MCAP_MAGIC)
    stream.seek(0)
    return finished
