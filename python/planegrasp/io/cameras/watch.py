"""Noticing what changes within a stream of frames."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planegrasp.io.cameras.events import EventKind
from planegrasp.io.cameras.stamps import GrowingStamps

if TYPE_CHECKING:
    from collections.abc import Callable

    from planegrasp.rgbd import RGBDFrame

_WITHOUT_DEPTH = 10
"""Frames without depth after which it is said to have stopped: single ones miss it now and then."""

_QUIET_FRAMES = 100
"""Stamps that go back again within so many frames are not reported again."""


class StreamWatch:
    """Passes frames on with growing timestamps, and reports what changed, once each time.

    Attributes:
        backward_jumps: how often a timestamp was not later than the one before it.
    """

    def __init__(self, report: Callable[[EventKind, str], None]) -> None:
        self.backward_jumps = 0
        self._report = report
        self._stamps = GrowingStamps()
        self._last_jump = -_QUIET_FRAMES
        self._frames = 0
        self._size: tuple[int, int] | None = None
        self._has_depth: bool | None = None
        self._without_depth = 0

    def passed(self, frame: RGBDFrame, stamp: float) -> RGBDFrame:
        """The frame with a timestamp [s] later than that of the frame before."""
        self._watch_size(frame)
        self._watch_depth(frame)
        growing, back = self._stamps.following(stamp)
        if growing != stamp and back:
            self._note_jump(back)
        self._frames += 1
        return frame if growing == frame.timestamp else replace(frame, timestamp=growing)

    def _note_jump(self, back: float) -> None:
        self.backward_jumps += 1
        if self._frames - self._last_jump >= _QUIET_FRAMES:
            self._report(
                EventKind.CLOCK,
                f"timestamps went back by {back:.6g} s: frames go on with times that only grow",
            )
        self._last_jump = self._frames

    def _watch_size(self, frame: RGBDFrame) -> None:
        size = (frame.camera.width, frame.camera.height)
        if self._size is not None and size != self._size:
            self._report(
                EventKind.RESOLUTION,
                f"images are {size[0]}×{size[1]} now, before they were "
                f"{self._size[0]}×{self._size[1]}",
            )
        self._size = size

    def _watch_depth(self, frame: RGBDFrame) -> None:
        if frame.depth is not None:
            if self._has_depth is False:
                self._report(EventKind.DEPTH_FOUND, "depth is there again")
            self._has_depth, self._without_depth = True, 0
            return
        self._without_depth += 1
        if self._has_depth and self._without_depth == _WITHOUT_DEPTH:
            self._has_depth = False
            self._report(
                EventKind.DEPTH_LOST,
                f"no depth for {_WITHOUT_DEPTH} frames while colour goes on: "
                f"poses come from known sizes until depth is back",
            )
