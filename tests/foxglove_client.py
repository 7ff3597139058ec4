"""A client of Foxglove's WebSocket protocol, written by its specification on `websockets`."""

from __future__ import annotations

import base64
import json
import struct
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory
from websockets.sync.client import connect

if TYPE_CHECKING:
    from collections.abc import Iterable

PROTOCOL = "foxglove.sdk.v1"
_MESSAGE_DATA = 1  # opcode, then subscription (u32) and log time [ns] (u64), then the message


class FoxgloveClient:
    """Subscribes to topics, and decodes what comes by the schemas that the server told."""

    def __init__(self, url: str) -> None:
        self._stack = ExitStack()
        connection = connect(url, subprotocols=[PROTOCOL], max_size=None)
        self._socket = self._stack.enter_context(connection)
        self.protocol = self._socket.subprotocol
        self.channels: dict[str, dict[str, Any]] = {}
        self.info: dict[str, Any] = {}
        while not (self.info and self.channels):
            self._told(json.loads(self._socket.recv(timeout=20)))
        self._decoders: dict[int, tuple[str, Any]] = {}

    def __enter__(self) -> FoxgloveClient:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def subscribe(self, topics: Iterable[str]) -> None:
        """Ask for topics."""
        wanted = []
        for topic in topics:
            channel = self.channels[topic]
            number = 1000 + channel["id"]
            self._decoders[number] = (topic, _decoder(channel))
            wanted.append({"id": number, "channelId": channel["id"]})
        self._socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))

    def receive(self, timeout: float = 20) -> tuple[str, int, Any]:
        """The next message: topic, log time [ns], decoded."""
        while True:
            data = self._socket.recv(timeout=timeout)
            if isinstance(data, str):
                self._told(json.loads(data))
                continue
            opcode, number, time = struct.unpack_from("<BIQ", data)
            if opcode == _MESSAGE_DATA:
                topic, decode = self._decoders[number]
                return topic, time, decode(data[13:])

    def _told(self, message: dict[str, Any]) -> None:
        if message["op"] == "serverInfo":
            self.info = message
        elif message["op"] == "advertise":
            self.channels |= {one["topic"]: one for one in message["channels"]}


def _decoder(channel: dict[str, Any]) -> Any:
    if channel["encoding"] == "json":
        return json.loads
    schema = Schema(
        id=channel["id"],
        name=channel["schemaName"],
        encoding=channel["schemaEncoding"],
        data=base64.b64decode(channel["schema"]),
    )
    return DecoderFactory().decoder_for(channel["encoding"], schema)
