"""Opens what a live run's results go to."""

from __future__ import annotations

import os
from contextlib import ExitStack
from typing import TYPE_CHECKING

from planegrasp.cli.common import messages
from planegrasp.cli.foxglove_options import foxglove_stream

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from planegrasp.cli.foxglove_output import FoxgloveOutput
    from planegrasp.cli.live_outputs import Output
    from planegrasp.io.cameras import Camera
    from planegrasp.io.foxglove import FoxgloveConfig
    from planegrasp.io.sources import FrameSource
    from planegrasp.objects import ObjectModel
    from planegrasp.viz.rerun_streams import RerunStream

__all__ = ["begin_foxglove", "begin_view", "open_outputs"]


def begin_view(
    view: bool, web: bool, rrd: Path | None, port: int, web_port: int, *, opens: bool
) -> Callable[[], RerunStream | None]:
    """Start the viewer that was asked for; a file is begun only when the result is called.

    So what takes long is done before the first frame, and no file is left where no frame comes.
    """
    if not (view or web or rrd):
        return lambda: None
    # Rerun's core writes what it meets to standard error; here it becomes one message.
    os.environ.setdefault("RUST_LOG", "off")
    from planegrasp.viz.rerun_live_blueprint import live_blueprint
    from planegrasp.viz.rerun_streams import to_browser, to_file, to_viewer

    blueprint = live_blueprint()
    if rrd is not None:
        return lambda: to_file(rrd, blueprint)
    if view:
        viewer = to_viewer(blueprint, port)
    else:
        viewer = to_browser(blueprint, port, web_port, opens=opens)
        messages().print(f"the viewer is at {viewer.url}", soft_wrap=True)
    return lambda: viewer


def open_outputs(
    stack: ExitStack,
    viewer: RerunStream | None,
    models: Sequence[ObjectModel],
    *,
    image_rate: float,
    lines: Path | None,
    frames: Path | None,
    wait: bool,
) -> list[Output]:
    """All that take what is seen; the stack closes them."""
    from planegrasp.cli.live_outputs import Record, Show
    from planegrasp.io.recording import open_recorder
    from planegrasp.io.sinks import LiveLinesWriter

    outputs: list[Output] = []
    if viewer is not None:
        from planegrasp.viz.palette import object_colors
        from planegrasp.viz.rerun_live import LiveRecording, LiveRecordingConfig

        colors = object_colors(model.name for model in models)
        recording = LiveRecording(viewer, colors, LiveRecordingConfig(image_rate=image_rate))
        outputs.append(stack.enter_context(Show(recording, wait=wait)))
    if lines is not None:
        outputs.append(stack.enter_context(Record(LiveLinesWriter(lines), wait=wait)))
    if frames is not None:
        outputs.append(stack.enter_context(Record(open_recorder(frames), wait=wait)))
    return outputs


def begin_foxglove(
    stack: ExitStack,
    models: Sequence[ObjectModel],
    address: str | None,
    log: Path | None,
    config: FoxgloveConfig,
    *,
    wait: bool,
) -> Callable[[Camera | FrameSource], FoxgloveOutput]:
    """Start the server that was asked for; a file is begun only when the result is called.

    Args:
        stack: closes the stream where the result is never called. Once it was, only what it gave
            does: a disk that hangs then holds up its thread, not the end of the program.
        models: all objects that may be seen.
        address: where to serve, see `foxglove_stream`; raises as that does.
        log: the file.
        config: what is logged.
        wait: see `FoxgloveOutput`.
    """
    from planegrasp.cli.foxglove_output import FoxgloveOutput

    owner = stack.enter_context(ExitStack())
    stream = owner.enter_context(foxglove_stream(models, address, config))

    def begin(source: Camera | FrameSource) -> FoxgloveOutput:
        if log is not None:
            stream.log_to(log)
        # A camera of ROS knows the stamps and frames of its images.
        output = FoxgloveOutput(stream, getattr(source, "header_of", None), wait=wait)
        owner.pop_all()
        return output

    return begin
