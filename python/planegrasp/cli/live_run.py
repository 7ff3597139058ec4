"""The loop of `planegrasp live`, and what is told of it."""

from __future__ import annotations

import math
import time
from collections import Counter, deque
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from planegrasp.cli.common import console
from planegrasp.cli.live_outputs import failure_of
from planegrasp.cli.live_status import distance, label
from planegrasp.errors import PlanegraspError
from planegrasp.live import RateMeter, prompt

if TYPE_CHECKING:
    from collections.abc import Sequence
    from threading import Event

    from planegrasp.cli.live_outputs import Output
    from planegrasp.cli.live_status import StatusLine
    from planegrasp.io.cameras import NewestFrame
    from planegrasp.live import Live, LiveFrame, LiveRates, Task
    from planegrasp.rgbd import RGBDFrame

_GLANCE = 0.2  # how often a wait for a frame looks whether to stop [s]
_KEPT_EVENTS = 1000
_QUIET = "dim"
_LOUD = "yellow"


class TaskChanges(Protocol):
    """Where another program may change the task."""

    def changed(self) -> Task | None:
        """The task, where it is another one than before, else None.

        Raises:
            PlanegraspError: the task is none that can be; raised once.
        """
        ...


@dataclass(slots=True)
class LiveRun:
    """A live run until its end.

    Attributes:
        source: what it is called.
        live: finds and follows the objects.
        stream: gives the frames.
        outputs: where results go.
        status: the terminal.
        tasks: what may change the task.
        frames: stop after so many.
        seconds: stop after so long, by the frames' time.
        failed: whether a recording could not be finished.
    """

    source: str
    live: Live
    stream: NewestFrame
    outputs: Sequence[Output]
    status: StatusLine
    tasks: TaskChanges | None = None
    frames: int | None = None
    seconds: float | None = None
    failed: bool = False
    _tracked: int = 0
    _span: float = 0.0
    _first: float | None = None
    _seen: Counter[str] = field(default_factory=Counter)
    _found: Counter[str] = field(default_factory=Counter)
    _lost: Counter[str] = field(default_factory=Counter)
    _rates: LiveRates | None = None
    _stopped: str = ""
    _events: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=_KEPT_EVENTS))

    def run(self, stop: Event) -> None:
        """Process the newest frames until a limit, the end of the source or a signal.

        Raises:
            PlanegraspError: the source or the detector failed.
        """
        from planegrasp.io.cameras import StreamStatus

        meter, seen = RateMeter(), None
        end = math.inf if self.seconds is None else time.monotonic() + self.seconds
        with prompt():
            while not self._stopped:
                frame = self.stream.next(timeout=_GLANCE)
                self._note_stream()
                self._read_task()
                if stop.is_set():
                    self._stopped = "signal"
                elif frame is not None:
                    seen = self._process(frame, meter)
                elif self.stream.status is StreamStatus.ENDED:
                    self._stopped = "end of the source"
                elif time.monotonic() > end:
                    self._stopped = "seconds"
                self._note_failures()
                self.status.show(self.stream, seen, self._rates)

    def finish(self) -> None:
        """Close the outputs, and say what could not be written."""
        for output in self.outputs:
            output.close()
        self._note_stream()
        self._note_failures()
        for output in self.outputs:
            if output.left_out:
                text = f"{output.left_out} frames were too fast for {output.what}"
                self._note("recording", text, _LOUD)
            if output.hangs and output.is_recording:
                self.failed = True
                self._note("recording", f"{output.what} has no end: the disk hangs", _LOUD)

    @property
    def hangs(self) -> bool:
        """Whether an output did not end; only after `finish`."""
        return any(output.hangs for output in self.outputs)

    def to_dict(self) -> dict[str, Any]:
        """Everything as one JSON object."""
        return {
            "source": self.source,
            "frames": self._tracked,
            "seconds": self._span,
            "read": self.stream.read,
            "dropped": self.stream.dropped,
            "losses": self.stream.losses,
            "passes": self.live.passes,
            "stopped": self._stopped,
            "recorded": not self.failed,
            "rates": None if self._rates is None else asdict(self._rates),
            "objects": {
                name: {
                    "frames": self._seen[name],
                    "found": self._found[name],
                    "lost": self._lost[name],
                }
                for name in sorted(self._found)
            },
            "events": list(self._events),
        }

    def print_summary(self) -> None:
        """Say on standard output what was seen."""
        out = console()
        losses = f", camera lost {self.stream.losses}×" if self.stream.losses else ""
        out.print(
            f"{self._tracked} frames in {self._span:.1f} s, {self.stream.dropped} dropped{losses}; "
            f"ended by {self._stopped or 'an error'}",
            soft_wrap=True,
        )
        for name in sorted(self._found):
            out.print(
                f"{name}: seen in {self._seen[name]} frames, found {self._found[name]}×, "
                f"lost {self._lost[name]}×",
                soft_wrap=True,
            )

    def _process(self, frame: RGBDFrame, meter: RateMeter) -> LiveFrame:
        begun = time.perf_counter()
        seen = self.live.process(frame)
        self._rates = meter.add(
            time.monotonic(),
            latency=time.perf_counter() - begun,
            read=self.stream.read,
            dropped=self.stream.dropped,
            passes=self.live.passes,
        )
        self._count(seen)
        for output in self.outputs:
            output.frame(seen, self._rates)
        if self._tracked == self.frames:
            self._stopped = "frames"
        elif self.seconds is not None and self._span >= self.seconds:
            self._stopped = "seconds"
        return seen

    def _count(self, seen: LiveFrame) -> None:
        self._tracked += 1
        if seen.frame.timestamp is not None:
            self._first = seen.frame.timestamp if self._first is None else self._first
            self._span = seen.frame.timestamp - self._first
        self._seen.update({track.name for track in seen.tracks if track.detection is not None})
        self._found.update(track.name for track in seen.new)
        self._lost.update(track.name for track in seen.lost)
        for track in seen.new:
            self._note("found", f"{label(track)} at {distance(track):.2f} m")
        for track in seen.lost:
            self._note("lost", label(track) + (f": {track.reason}" if track.reason else ""))

    def _read_task(self) -> None:
        if self.tasks is None:
            return
        try:
            task = self.tasks.changed()
        except PlanegraspError as error:
            self._note("task", f"{error}; the old one stays", _LOUD)
            return
        if task is not None:
            self.live.task = task
            self._note("task", task_text(task))

    def _note_stream(self) -> None:
        from planegrasp.io.cameras import EventKind

        for event in self.stream.take_events():
            style = _QUIET if event.kind is EventKind.ENDED else _LOUD
            self._note(f"camera {event.kind}", event.message, style)

    def _note_failures(self) -> None:
        for output in self.outputs:
            failure = failure_of(output)
            if failure is not None:
                text, is_missing = failure
                self.failed |= is_missing
                self._note("recording" if is_missing else "view", text, _LOUD)

    def _note(self, kind: str, text: str, style: str = _QUIET) -> None:
        self._events.append({"kind": kind, "message": text, "frame": self._tracked})
        self.status.event(kind, text, style)
        for output in self.outputs:
            output.note(f"{kind}: {text}", "WARN" if style == _LOUD else "INFO")


def task_text(task: Task) -> str:
    """A task in words."""
    ordered = sorted(task.priorities.items(), key=lambda entry: -entry[1])
    wanted = ", ".join(f"{name} {priority:g}" for name, priority in ordered) or "all objects"
    others = "" if task.others or not task.priorities else ", no others"
    return f"{wanted}{others}; {1000 * task.budget:.0f} ms a frame"
