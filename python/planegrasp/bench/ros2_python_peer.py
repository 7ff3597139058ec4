"""A peer (`ros2_peer`) on the same DDS, where there is no other implementation at hand."""

from __future__ import annotations

import argparse
import json
import sys
import threading
import time
from copy import copy
from typing import Any

from planegrasp.io.messages.header import Stamp
from planegrasp.io.ros2.dds import DdsConfig, DdsNode, DdsReader, DdsWriter, dds_type
from planegrasp.io.ros2.dds.as_json import message_from_json, message_to_json
from planegrasp.io.ros2.profiles import DEFAULT, KEPT, SENSOR, TF

_PROFILES = {"default": DEFAULT, "sensor": SENSOR, "tf": TF, "kept": KEPT}
_GLANCE = 0.1  # [s]


def main() -> None:
    """Do as standard input says, until it ends."""
    parser = argparse.ArgumentParser()
    parser.add_argument("domain", type=int)
    parser.add_argument("--brief", action="store_true")
    for option in ("--read", "--write"):
        parser.add_argument(option, nargs=3, action="append", default=[])
    given = parser.parse_args()
    with DdsNode(DdsConfig(given.domain)) as node:
        readers = [node.reader(topic, kind, _PROFILES[name]) for topic, kind, name in given.read]
        writers = {
            topic: (node.writer(topic, kind, _PROFILES[name]), dds_type(kind))
            for topic, kind, name in given.write
        }
        stop = threading.Event()
        listening = threading.Thread(target=_listen, args=(node, readers, given.brief, stop))
        _say({"ready": True})
        listening.start()
        try:
            for line in sys.stdin:
                _obey(json.loads(line), writers)
        finally:
            stop.set()
            listening.join()


def _listen(node: DdsNode, readers: list[DdsReader], brief: bool, stop: threading.Event) -> None:
    waiting = node.waiting(readers)
    while not stop.is_set():
        waiting.wait(_GLANCE)
        for reader in readers:
            for message, _ in reader.take():
                about: dict[str, Any] = {"topic": reader.topic, "at": time.time_ns()}
                content = message_to_json(_stamp(message) if brief else message)
                _say({**about, "stamp" if brief else "message": content})
    waiting.close()


def _obey(line: dict[str, Any], writers: dict[str, tuple[DdsWriter, Any]]) -> None:
    if "write" in line:
        writer, message = _prepared(line["write"], writers)
        writer.write(message)
        return
    play = line["play"]
    frames = [[_prepared(one, writers) for one in frame] for frame in play["frames"]]
    begun = time.monotonic()
    for number in range(play["count"]):
        time.sleep(max(begun + number / play["rate"] - time.monotonic(), 0.0))
        stamp = Stamp.from_nanoseconds(time.time_ns())
        now = dds_type("builtin_interfaces/msg/Time")(stamp.seconds, stamp.nanoseconds)
        for writer, message in frames[number % len(frames)]:
            sent = copy(message)
            sent.header = copy(message.header)
            sent.header.stamp = now
            writer.write(sent)
    _say({"played": play["count"]})


def _prepared(
    one: dict[str, Any], writers: dict[str, tuple[DdsWriter, Any]]
) -> tuple[DdsWriter, Any]:
    writer, kind = writers[one["topic"]]
    return writer, message_from_json(kind, one["message"])


def _stamp(message: Any) -> Any:
    """Of the header, or of the first part that has one."""
    for members in ("transforms", "markers"):
        parts = getattr(message, members, None)
        if parts:
            return parts[0].header.stamp
    header = getattr(message, "header", None)
    return header.stamp if header else dds_type("builtin_interfaces/msg/Time")(0, 0)


def _say(line: dict[str, Any]) -> None:
    # One write, so that lines of two threads do not mix.
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
