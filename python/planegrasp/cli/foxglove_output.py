"""What a live run gives to Foxglove: a log, a live server, or both."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import RecordingError
from planegrasp.live.beside import Beside

if TYPE_CHECKING:
    from collections.abc import Callable

    from planegrasp.io.foxglove import FoxgloveStream
    from planegrasp.io.messages import Header
    from planegrasp.live import LiveFrame, LiveRates
    from planegrasp.rgbd import RGBDFrame

__all__ = ["FoxgloveOutput"]

_WAITING = 30  # frames that wait to be logged at most: a second of them
_KEPT_NOTES = 1000


class FoxgloveOutput(ClosesAtEnd):
    """Logs every frame; only the newest where there is no file that should have them all.

    A file that cannot be written any further does not end the server.
    """

    def __init__(
        self,
        stream: FoxgloveStream,
        header_of: Callable[[RGBDFrame], Header | None] | None = None,
        *,
        wait: bool,
    ) -> None:
        """Start.

        Args:
            stream: with its file and its server; closed at the end, by nobody else: another
                thread would wait without end for a disk that hangs.
            header_of: gives the header of a frame's image, where the source knows it.
            wait: whether to wait until there is time for a frame instead of leaving some out.
        """
        self._stream = stream
        self._header_of = header_of
        self._left_out = 0
        self.what = f"the log {stream.log.path}" if stream.log else "Foxglove"
        self._notes: deque[tuple[str, str]] = deque(maxlen=_KEPT_NOTES)
        self._failure: RecordingError | None = None
        self._beside: Beside[tuple[LiveFrame, Header | None]] = Beside(
            self._write,
            self._end,
            wait=wait,
            name="planegrasp-foxglove",
        )

    @property
    def is_recording(self) -> bool:
        """Whether there is a file."""
        return self._stream.log is not None

    @property
    def left_out(self) -> int:
        """Frames that came faster than they were logged; what is only shown is not missed."""
        return self._left_out

    @property
    def hangs(self) -> bool:
        """Whether the disk keeps it from ending."""
        return self._beside.hangs

    def frame(self, seen: LiveFrame, rates: LiveRates) -> None:
        """Log it when there is time."""
        has_log = self.is_recording
        self._beside.waiting = _WAITING if has_log else 1
        before = self._beside.left_out
        self._beside.put((seen, self._header_of(seen.frame) if self._header_of else None))
        if has_log:
            self._left_out += self._beside.left_out - before

    def note(self, text: str, level: str) -> None:
        """Log it with the next frame."""
        self._notes.append((text, level))

    def take_error(self) -> Exception | None:
        """Why the log ended, or all of it, once."""
        failure, self._failure = self._failure, None
        return failure or self._beside.take_error()

    def close(self) -> None:
        """Log what is left, and end."""
        self._beside.close()

    def _write(self, item: tuple[LiveFrame, Header | None]) -> None:
        self._write_notes()
        try:
            self._stream.live(*item)
        except RecordingError as error:
            if self._stream.server is None:
                raise
            self._failure = error

    def _write_notes(self) -> None:
        while self._notes:
            self._stream.note(*self._notes.popleft())

    def _end(self) -> None:
        self._write_notes()
        self._stream.close()
