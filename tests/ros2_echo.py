"""A process that publishes on /out/… what it gets on /in/…, for each type of message."""

from __future__ import annotations

import sys
import time

from ros2_examples import messages

from planegrasp.io.ros2.dds import DdsConfig, DdsNode, dds_type


def topic_of(kind, way):
    return f"/{way}/{kind.split('/')[-1].lower()}"


def main():
    kinds = sorted(messages(dds_type))
    with DdsNode(DdsConfig(int(sys.argv[1]))) as node:
        ways = [
            (node.reader(topic_of(kind, "in"), kind), node.writer(topic_of(kind, "out"), kind))
            for kind in kinds
        ]
        print("ready", flush=True)
        while True:
            for reader, writer in ways:
                for message, _ in reader.take():
                    writer.write(message)
            time.sleep(0.002)


if __name__ == "__main__":
    main()
