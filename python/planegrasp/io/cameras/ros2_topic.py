"""One topic of a camera, and one publisher of it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Self

from planegrasp.io.ros2.profiles import SENSOR, Profile

if TYPE_CHECKING:
    from collections.abc import Callable

    from planegrasp.io.ros2.transport import Published, Reader, Transport

__all__ = ["OneTopic"]

_SILENT = 0.5  # a publisher that gave nothing for so long makes room for another [s]


class OneTopic:
    """Takes the messages of the first publisher that is heard, until it is gone or silent.

    Attributes:
        reader: of the topic.
        latest: the last message that was taken, None before the first.
    """

    def __init__(self, reader: Reader) -> None:
        self.reader = reader
        self.latest: Any = None
        self._publisher: int | None = None
        self._heard = 0.0

    @classmethod
    def of(cls, node: Transport, topic: str, published: Published) -> Self:
        """Subscribe as well as the publishers offer: large images lose parts where nobody asks."""
        profile = Profile(SENSOR.depth) if published.reliable else SENSOR
        return cls(node.reader(topic, published.message, profile))

    def take(self, say: Callable[[str], None]) -> list[Any]:
        """What has come from the publisher that is listened to, oldest first.

        Args:
            say: is told of further publishers.
        """
        taken = []
        for message, publisher in self.reader.take():
            now = time.monotonic()
            if publisher != self._publisher:
                if not self._is_free(now):
                    say(
                        f"more than one publishes on {self.reader.topic}: only the first is "
                        f"listened to"
                    )
                    continue
                self._publisher = publisher
            self._heard = now
            taken.append(message)
        if taken:
            self.latest = taken[-1]
        return taken

    def _is_free(self, now: float) -> bool:
        if self._publisher is None or now - self._heard > _SILENT:
            return True
        return not self.reader.publisher_is_there(self._publisher)
