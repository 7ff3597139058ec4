"""`planegrasp record`: write the frames of a camera or of any source to disk."""

from __future__ import annotations

import math
import time
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from planegrasp.cli.common import JsonOption, console, messages, print_json
from planegrasp.cli.source_options import (
    CameraOption,
    ColorTopicOption,
    DepthScaleOption,
    DepthTopicOption,
    FieldOfViewOption,
    FramesOption,
    HeightOption,
    InfoTopicOption,
    OutputArgument,
    RateOption,
    SecondsOption,
    SourceArgument,
    WidthOption,
    open_frames,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from threading import Event

    from planegrasp.io.cameras import NewestFrame, StreamEvent
    from planegrasp.io.recording import Recorder
    from planegrasp.rgbd import RGBDFrame

_GLANCE = 0.2  # how often a wait for a frame looks whether to stop [s]


def record(
    source: SourceArgument,
    output: OutputArgument,
    *,
    frames: FramesOption = None,
    seconds: SecondsOption = None,
    camera: CameraOption = None,
    fov: FieldOfViewOption = None,
    depth_scale: DepthScaleOption = None,
    width: WidthOption = None,
    height: HeightOption = None,
    fps: RateOption = None,
    color_topic: ColorTopicOption = None,
    depth_topic: DepthTopicOption = None,
    info_topic: InfoTopicOption = None,
    as_json: JsonOption = False,
) -> None:
    """Record the frames of a camera or of another source, until its end or Ctrl-C.

    A camera that is unplugged is waited for. What was recorded can be read also where the recording
    was cut off.

        planegrasp record realsense run.mcap --seconds 10

        planegrasp record opencv:0 run --frames 100 --camera camera.json
    """
    from planegrasp.cli.stopping import stop_on_signals
    from planegrasp.io.cameras import NewestFrame, is_camera_name
    from planegrasp.io.recording import open_recorder

    opened = open_frames(
        source,
        camera=camera,
        fov=fov,
        depth_scale=depth_scale,
        mode=(width, height, fps),
        topics=(color_topic, depth_topic, info_topic),
    )
    run = _Run(source, output, frames, seconds)
    with ExitStack() as stack:
        stop = stack.enter_context(stop_on_signals())
        if is_camera_name(source):
            live = stack.enter_context(NewestFrame(opened))
            run.show_notes(live.notes)
            run.record(run.live_frames(live, stop), stack.enter_context(open_recorder(output)))
            run.finish(live)
        else:
            run.show_notes(opened.notes)
            run.record(run.until(stop, opened), stack.enter_context(open_recorder(output)))
    if as_json:
        print_json(run.to_dict())
    else:
        run.print_summary()


@dataclass(slots=True)
class _Run:
    """One recording and what is told of it."""

    source: str
    output: Path
    frames: int | None
    seconds: float | None
    written: int = 0
    with_depth: int = 0
    duration: float = 0.0
    dropped: int = 0
    losses: int = 0
    stopped: str = "end of the source"
    events: list[StreamEvent] = field(default_factory=list)

    def record(self, frames: Iterator[RGBDFrame], recorder: Recorder) -> None:
        """Write frames until they end or there are enough."""
        from planegrasp.cli.progress import frame_progress

        with frame_progress(f"recording {self.output}", self.frames) as advance:
            for frame in frames:
                recorder.write(frame)
                self.written, self.duration = recorder.frames, recorder.seconds
                self.with_depth += frame.depth is not None
                advance()
                if recorder.frames == self.frames:
                    self.stopped = "frames"
                    break
                if self.seconds is not None and recorder.seconds >= self.seconds:
                    self.stopped = "seconds"
                    break

    def until(self, stop: Event, frames: Any) -> Iterator[RGBDFrame]:
        """The frames of a source until a signal."""
        for frame in frames:
            if stop.is_set():
                self.stopped = "signal"
                return
            yield frame

    def live_frames(self, live: NewestFrame, stop: Event) -> Iterator[RGBDFrame]:
        """The frames of a camera until a signal or the end of the time, and what happens to it."""
        from planegrasp.io.cameras import StreamStatus

        end = math.inf if self.seconds is None else time.monotonic() + self.seconds
        while True:
            frame = live.next(timeout=_GLANCE)
            self._show_events(live)
            if frame is not None:
                yield frame
            if stop.is_set():
                self.stopped = "signal"
                return
            if frame is None and live.status is StreamStatus.ENDED:
                return
            if frame is None and time.monotonic() > end:
                self.stopped = "seconds"
                return

    def finish(self, live: NewestFrame) -> None:
        """Keep what the stream counted."""
        self._show_events(live)
        self.dropped, self.losses = live.dropped, live.losses

    def show_notes(self, notes: tuple[str, ...]) -> None:
        """Tell what is to know of the source."""
        for note in notes:
            _tell("note", note)

    def to_dict(self) -> dict[str, Any]:
        """Everything as one JSON object."""
        return {
            "source": self.source,
            "output": str(self.output),
            "frames": self.written,
            "with_depth": self.with_depth,
            "seconds": self.duration,
            "dropped": self.dropped,
            "losses": self.losses,
            "stopped": self.stopped,
            "events": [
                {"kind": event.kind, "message": event.message, "frame": event.frame}
                for event in self.events
            ],
        }

    def print_summary(self) -> None:
        """Say on standard output what was recorded."""
        dropped = f", {self.dropped} more were too fast for the disk" if self.dropped else ""
        console().print(
            f"{self.written} frames ({self.with_depth} with depth, {self.duration:.1f} s) in "
            f"{self.output}{dropped}",
            soft_wrap=True,
        )

    def _show_events(self, live: NewestFrame) -> None:
        for event in live.take_events():
            self.events.append(event)
            _tell(event.kind, event.message)


def _tell(kind: str, message: str) -> None:
    """Print `kind: message` to standard error, the message as it is."""
    from rich.text import Text

    messages().print(Text.assemble((f"{kind}: ", "yellow"), message), soft_wrap=True)
