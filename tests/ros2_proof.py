"""The peer on another DDS: ros2/proof, in Rust on RustDDS."""

from __future__ import annotations

from pathlib import Path

import pytest

from planegrasp.io.ros2.dds import dds_type
from planegrasp.io.ros2.dds.as_json import message_from_json

PROGRAM = Path(__file__).parents[1] / "ros2" / "proof" / "target" / "release" / "ros2-peer"


def built_peer():
    """The program; the test is left out where `make proof`, part of `make test`, did not run."""
    if not PROGRAM.exists():
        pytest.skip("the peer on another DDS is not built: make proof")
    return PROGRAM


class Heard:
    """What a peer says of what it reads.

    Attributes:
        messages: by topic, in the order in which they came.
        played: how many frames it says to have played.
    """

    def __init__(self, peer, reads):
        self.played = 0
        self._peer = peer
        self.messages = {one.topic: [] for one in reads}
        self._types = {one.topic: dds_type(one.message) for one in reads}

    def listen(self, seconds=0.0):
        """Take what it says until it says nothing for so long [s]."""
        while (line := self._peer.next(seconds)) is not None:
            assert "error" not in line, line
            self.played += line.get("played", 0)
            if "topic" in line:
                topic = line["topic"]
                message = message_from_json(self._types[topic], line["message"])
                self.messages[topic].append(message)


class Kept:
    """A `Transport` that keeps what is written, and passes it on.

    Attributes:
        messages: by topic.
        writers: by topic.
    """

    def __init__(self, node):
        self._node = node
        self.messages, self.writers = {}, {}

    def __getattr__(self, name):
        return getattr(self._node, name)

    def writer(self, topic, *about):
        writer = self.writers[topic] = self._node.writer(topic, *about)
        write, kept = writer.write, self.messages.setdefault(topic, [])
        writer.write = lambda message: write(message) and kept.append(message)
        return writer
