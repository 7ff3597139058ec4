"""Where a live run's results go, beside the frames: to a viewer, into files."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Protocol

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import PlanegraspError, ViewerError
from planegrasp.live.beside import Beside

if TYPE_CHECKING:
    from planegrasp.io.recording import Recorder
    from planegrasp.io.sinks import LiveLinesWriter
    from planegrasp.live import LiveFrame, LiveRates
    from planegrasp.viz.rerun_live import LiveRecording

# Frames that wait to be written at most: a second of them.
_WAITING = 30


class Output(Protocol):
    """Takes what is seen, and never holds up who gives it.

    Attributes:
        what: it is, for messages.
    """

    what: str

    @property
    def is_recording(self) -> bool:
        """Whether what it does not write is missing in the end."""
        ...

    @property
    def left_out(self) -> int:
        """Frames that came faster than they were written."""
        ...

    @property
    def hangs(self) -> bool:
        """Whether it did not end when it was closed."""
        ...

    def frame(self, seen: LiveFrame, rates: LiveRates) -> None:
        """Take what is known after a frame."""
        ...

    def note(self, text: str, level: str) -> None:
        """Take in words what happened."""
        ...

    def take_error(self) -> Exception | None:
        """Why it takes nothing any more, once; None while it does."""
        ...

    def close(self) -> None:
        """Write what is left."""
        ...


class Show(ClosesAtEnd):
    """Shows the newest frame in Rerun; every frame where it may wait for it."""

    what = "the view"
    is_recording = False

    def __init__(self, recording: LiveRecording, *, wait: bool) -> None:
        self._recording = recording
        self._notes: deque[tuple[str, str]] = deque(maxlen=1000)
        self._beside: Beside[tuple[LiveFrame, LiveRates]] = Beside(
            self._write, self._end, wait=wait, name="planegrasp-view"
        )

    @property
    def left_out(self) -> int:
        """0: what is not shown is not missed."""
        return 0

    @property
    def hangs(self) -> bool:
        """Whether a viewer keeps it from ending."""
        return self._beside.hangs

    def frame(self, seen: LiveFrame, rates: LiveRates) -> None:
        """Show it, unless a newer one comes before there is time for it."""
        self._beside.put((seen, rates))

    def note(self, text: str, level: str) -> None:
        """Show it with the next frame."""
        self._notes.append((text, level))

    def take_error(self) -> Exception | None:
        """Why nothing is shown any more, once."""
        return self._beside.take_error()

    def close(self) -> None:
        """Show what is left."""
        self._beside.close()

    def _write(self, item: tuple[LiveFrame, LiveRates]) -> None:
        self._recording.write(*item)
        self._write_notes()

    def _write_notes(self) -> None:
        while self._notes:
            self._recording.note(*self._notes.popleft())

    def _end(self) -> None:
        if self._beside.error is None:
            self._write_notes()
        self._recording.close()


class Record(ClosesAtEnd):
    """Writes every frame, or what was seen in it."""

    is_recording = True

    def __init__(self, writer: LiveLinesWriter | Recorder, *, wait: bool) -> None:
        self.what = f"the recording {writer.path}"
        self._writer = writer
        self._beside: Beside[LiveFrame] = Beside(
            self._write, writer.close, waiting=_WAITING, wait=wait, name="planegrasp-record"
        )

    @property
    def left_out(self) -> int:
        """Frames that came faster than they were written."""
        return self._beside.left_out

    @property
    def hangs(self) -> bool:
        """Whether the disk keeps it from ending."""
        return self._beside.hangs

    def frame(self, seen: LiveFrame, rates: LiveRates) -> None:
        """Write it when there is time."""
        self._beside.put(seen)

    def note(self, text: str, level: str) -> None:
        """Not recorded."""

    def take_error(self) -> Exception | None:
        """Why nothing is written any more, once."""
        return self._beside.take_error()

    def close(self) -> None:
        """Write what is left."""
        self._beside.close()

    def _write(self, seen: LiveFrame) -> None:
        from planegrasp.io.sinks import LiveLinesWriter

        if isinstance(self._writer, LiveLinesWriter):
            self._writer.write(seen)
        else:
            self._writer.write(seen.frame)


def failure_of(output: Output) -> tuple[str, bool] | None:
    """What to say of an output that failed, once, and whether something is missing for it.

    Raises:
        Exception: it failed for no reason of its own: a fault of the program.
    """
    error = output.take_error()
    if error is None:
        return None
    if not isinstance(error, (PlanegraspError, OSError)):
        raise error
    return f"{error}; tracking goes on without {output.what}", not isinstance(error, ViewerError)
