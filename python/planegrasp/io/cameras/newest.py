"""The newest frame of a camera or a recording, read in a thread of its own."""

from __future__ import annotations

import math
import time
from collections import deque
from dataclasses import dataclass
from threading import Event, Lock, Thread
from typing import TYPE_CHECKING

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import CameraLostError, InvalidInputError
from planegrasp.io.cameras.base import Reporting
from planegrasp.io.cameras.events import EventKind, StreamEvent, StreamStatus
from planegrasp.io.cameras.pacing import paced, stamped
from planegrasp.io.cameras.slot import FrameSlot
from planegrasp.io.cameras.watch import StreamWatch

if TYPE_CHECKING:
    from collections.abc import Iterator

    from typing_extensions import TypeIs

    from planegrasp.io.cameras.base import Camera
    from planegrasp.io.sources import FrameSource
    from planegrasp.rgbd import RGBDFrame

_KEPT_EVENTS = 1000


@dataclass(frozen=True, slots=True)
class StreamConfig:
    """How a camera is waited for, and how a recording is played.

    Attributes:
        first_retry: how long after its loss a camera is tried again [s]; every further try waits
            twice as long,
        longest_retry: … but no longer than this [s].
        wait_at_start: whether a camera that is not there at the start is waited for, instead of
            being an error.
        pace: whether a recording is played at its own speed and a slow consumer misses frames, as
            with a camera; else it waits for the consumer and no frame is dropped.
        frames_per_second: of a recording that has no timestamps.
        longest_pause: a longer gap in a recording is played as one of this length [s].
        close_timeout: how long `close` waits for a driver that does not return [s].
    """

    first_retry: float = 0.25
    longest_retry: float = 5.0
    wait_at_start: bool = False
    pace: bool = True
    frames_per_second: float = 30.0
    longest_pause: float = 2.0
    close_timeout: float = 10.0

    def __post_init__(self) -> None:
        values = {
            "first_retry": self.first_retry,
            "longest_retry": self.longest_retry,
            "frames_per_second": self.frames_per_second,
            "longest_pause": self.longest_pause,
            "close_timeout": self.close_timeout,
        }
        for name, value in values.items():
            if not (math.isfinite(value) and value > 0):
                raise InvalidInputError(f"{name} must be a number > 0, got {value}")


class NewestFrame(ClosesAtEnd):
    """Reads a camera or a recording in a thread and hands out the newest frame.

    A slow consumer misses frames, they never queue up. Timestamps of the frames strictly increase,
    whatever the source's own do (see `GrowingStamps`). A camera that vanishes is tried again until
    it is back. Frames pass also where their size changes or depth stops. All of this is reported
    once each time, as a `StreamEvent`.

    A context manager: at its end the thread is joined and the camera released. Consumers may be in
    several threads; each frame goes to one of them.

    Attributes:
        name: of the source.
    """

    def __init__(self, source: Camera | FrameSource, config: StreamConfig | None = None) -> None:
        """Open the camera and begin to read.

        Raises:
            CameraLostError: the camera is not there, and the config does not say to wait for it.
        """
        self.config = config or StreamConfig()
        self.name = source.name
        self._source = source
        self._slot = FrameSlot()
        self._stop = Event()
        self._watch = StreamWatch(self._report)
        self._events: deque[StreamEvent] = deque(maxlen=_KEPT_EVENTS)
        self._events_lock = Lock()
        self._losses = 0
        self._is_lost = False
        self._lost_since = 0.0
        self._retry = self.config.first_retry
        self._error: BaseException | None = None
        if _is_camera(source):
            self._open_first(source)
        # A daemon, so that a driver that never returns cannot keep the program from ending.
        self._thread = Thread(target=self._run, name=f"frames of {self.name}", daemon=True)
        self._thread.start()

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know of the source, see `FrameSource.notes`."""
        return self._source.notes

    @property
    def status(self) -> StreamStatus:
        """Whether frames come, the camera is lost, or no frame comes any more."""
        if self._slot.closed:
            return StreamStatus.ENDED
        return StreamStatus.LOST if self._is_lost else StreamStatus.RUNNING

    @property
    def read(self) -> int:
        """Frames that were read."""
        return self._slot.brought

    @property
    def dropped(self) -> int:
        """Frames that nobody took before the next one came."""
        return self._slot.dropped

    @property
    def losses(self) -> int:
        """How often the camera vanished."""
        return self._losses

    @property
    def backward_jumps(self) -> int:
        """How often the source's timestamps went back."""
        return self._watch.backward_jumps

    def take_events(self) -> list[StreamEvent]:
        """What happened since this was last called, oldest first; at most the latest thousand."""
        with self._events_lock:
            events = list(self._events)
            self._events.clear()
        return events

    def next(self, timeout: float | None = None) -> RGBDFrame | None:
        """Wait for a frame that has not been handed out yet.

        Args:
            timeout: longest time to wait [s]; None waits until there is one or none can come.

        Returns:
            The newest frame; None after the timeout, or when the stream has ended (see `status`).

        Raises:
            PlanegraspError: the source failed in a way that trying again does not help, for
                example by a damaged file.
        """
        frame = self._slot.take(timeout)
        if frame is None and self._slot.closed and self._error is not None:
            raise self._error
        return frame

    def __iter__(self) -> Iterator[RGBDFrame]:
        """The newest frames until the stream ends; raises as `next` does."""
        while (frame := self.next()) is not None:
            yield frame

    def close(self) -> None:
        """Stop reading, and release the camera.

        Waits for a driver that does not return from reading for at most `config.close_timeout`; the
        camera is then released when it does.
        """
        self._stop.set()
        self._slot.close(drop=True)
        self._thread.join(self.config.close_timeout)

    def _run(self) -> None:
        source = self._source
        try:
            if _is_camera(source):
                self._read_camera(source)
            else:
                self._read_recording(source)
        except BaseException as error:  # raised again where frames are taken
            self._error = error
        finally:
            self._slot.close()

    def _read_camera(self, camera: Camera) -> None:
        try:
            while not self._stop.is_set():
                try:
                    if self._is_lost:
                        camera.open()
                    frame = camera.read()
                except CameraLostError as error:
                    self._pass_reports(camera)
                    camera.close()
                    self._wait_for_camera(error)
                    continue
                if self._is_lost:
                    self._note_found()
                self._pass_reports(camera)
                self._pass_on(frame, frame.timestamp)
        finally:
            camera.close()

    def _read_recording(self, source: FrameSource) -> None:
        config = self.config
        frames = stamped(source, config.frames_per_second)
        if config.pace:
            frames = paced(frames, self._stop, config.longest_pause)
        for frame in frames:
            if self._stop.is_set():
                return
            self._pass_on(frame, frame.timestamp)
            if not config.pace:
                self._slot.wait_until_empty()
        self._report(EventKind.ENDED, f"{self.name} is at its end")

    def _pass_on(self, frame: RGBDFrame, stamp: float | None) -> None:
        if stamp is None or not math.isfinite(stamp):
            stamp = time.time()
        self._slot.put(self._watch.passed(frame, stamp))

    def _open_first(self, camera: Camera) -> None:
        try:
            camera.open()
        except CameraLostError as error:
            camera.close()
            if not self.config.wait_at_start:
                raise
            self._note_lost(error)

    def _pass_reports(self, camera: Camera) -> None:
        if isinstance(camera, Reporting):
            for report in camera.take_reports():
                self._report(EventKind.SOURCE, report)

    def _wait_for_camera(self, error: CameraLostError) -> None:
        if not self._is_lost:
            self._note_lost(error)
        self._stop.wait(self._retry)
        self._retry = min(2 * self._retry, self.config.longest_retry)

    def _note_lost(self, error: CameraLostError) -> None:
        self._is_lost = True
        self._losses += 1
        self._retry = self.config.first_retry
        self._lost_since = time.monotonic()
        self._report(EventKind.LOST, f"{error}; trying again until it is there")

    def _note_found(self) -> None:
        self._is_lost = False
        away = time.monotonic() - self._lost_since
        self._report(EventKind.FOUND, f"{self.name} gives frames again, after {away:.1f} s")

    def _report(self, kind: EventKind, message: str) -> None:
        with self._events_lock:
            self._events.append(StreamEvent(kind, message, self._slot.brought))


def _is_camera(source: Camera | FrameSource) -> TypeIs[Camera]:
    return hasattr(source, "open")
