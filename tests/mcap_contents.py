"""What an MCAP file says, read by mcap's own reader with the schemas that are in it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

if TYPE_CHECKING:
    from pathlib import Path


def contents(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """(log time [ns], decoded message) by topic; JSON as Python's values."""
    found: dict[str, list[tuple[int, Any]]] = {}
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        factory = DecoderFactory()
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.message_encoding == "json":
                value = json.loads(message.data)
            else:
                value = factory.decoder_for(channel.message_encoding, schema)(message.data)
            found.setdefault(channel.topic, []).append((message.log_time, value))
    return found


def schemas(path: Path) -> dict[str, str]:
    """Name of the schema by topic, by the table of contents."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    return {c.topic: summary.schemas[c.schema_id].name for c in summary.channels.values()}


def chunks(path: Path) -> list[tuple[int, int]]:
    """First byte of each chunk, and the one behind it."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    return [
        (one.chunk_start_offset, one.chunk_start_offset + one.chunk_length)
        for one in summary.chunk_indexes
    ]
