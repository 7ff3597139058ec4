"""A place for one frame between a thread that brings frames and one that takes them."""

from __future__ import annotations

from threading import Condition
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planegrasp.rgbd import RGBDFrame


class FrameSlot:
    """Holds the newest frame until it is taken; a newer one takes its place.

    Attributes:
        brought: frames that were put in.
        dropped: frames that were replaced before they were taken.
        closed: whether no further frame comes.
    """

    def __init__(self) -> None:
        self.brought = 0
        self.dropped = 0
        self.closed = False
        self._frame: RGBDFrame | None = None
        self._changed = Condition()

    def put(self, frame: RGBDFrame) -> None:
        """Leave a frame, in the place of one that has not been taken."""
        with self._changed:
            if self.closed:
                return
            self.dropped += self._frame is not None
            self.brought += 1
            self._frame = frame
            self._changed.notify_all()

    def wait_until_empty(self) -> None:
        """Wait until the last frame has been taken, or the slot is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self.closed or self._frame is None)

    def take(self, timeout: float | None) -> RGBDFrame | None:
        """Wait for a frame [s] and take it: None after the timeout, and where none comes any more.

        A frame that was left before the slot was closed can still be taken.
        """
        with self._changed:
            self._changed.wait_for(lambda: self.closed or self._frame is not None, timeout)
            frame, self._frame = self._frame, None
            self._changed.notify_all()
            return frame

    def close(self, *, drop: bool = False) -> None:
        """Let nobody wait any longer; with `drop` the frame in it is gone, too."""
        with self._changed:
            self.closed = True
            if drop:
                self._frame = None
            self._changed.notify_all()
