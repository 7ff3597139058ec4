"""What a live run gives to ROS 2, and takes from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.closing import ClosesAtEnd

if TYPE_CHECKING:
    from collections.abc import Callable

    from planegrasp.io.messages import Header
    from planegrasp.io.ros2 import LivePublisher
    from planegrasp.live import LiveFrame, LiveRates
    from planegrasp.rgbd import RGBDFrame

__all__ = ["Publish"]


class Publish(ClosesAtEnd):
    """Publishes every frame at once: DDS takes it without waiting for who reads."""

    what = "ROS 2"
    left_out = 0
    is_recording = False
    hangs = False

    def __init__(
        self,
        publisher: LivePublisher,
        header_of: Callable[[RGBDFrame], Header | None] | None = None,
    ) -> None:
        """Remember where to publish.

        Args:
            publisher: takes what is seen.
            header_of: gives the header of a frame's image, where the source knows it.
        """
        self._publisher = publisher
        self._header_of = header_of

    def frame(self, seen: LiveFrame, rates: LiveRates) -> None:
        """Publish it."""
        self._publisher.publish(seen, self._header_of(seen.frame) if self._header_of else None)

    def note(self, text: str, level: str) -> None:
        """Publish what happened."""
        kind, _, message = text.partition(": ")
        self._publisher.event(kind, message)

    def take_error(self) -> Exception | None:
        """None: what fails here is a fault of the program, and is raised at once."""
        return None

    def close(self) -> None:
        """Nothing waits to be published; the publisher is closed by who made it."""
