"""`planegrasp live`: find and follow a library's objects while a camera runs."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from planegrasp.cli.common import JsonOption, LibraryOption, messages, print_json, wanted_models
from planegrasp.cli.foxglove_options import (
    LogColorOption,
    foxglove_config,
    log_option,
)
from planegrasp.cli.source_options import (
    CameraOption,
    ColorTopicOption,
    DepthScaleOption,
    DepthTopicOption,
    FieldOfViewOption,
    FramesOption,
    HeightOption,
    InfoTopicOption,
    RateOption,
    SecondsOption,
    SourceArgument,
    WidthOption,
    open_frames,
)
from planegrasp.cli.task_options import TASK_PANEL, BudgetOption, WantOption, task_of
from planegrasp.errors import InvalidInputError

_SHOWING = "Viewer"
_FOXGLOVE = "Foxglove"
_RECORDING = "Recording"


def live(
    source: SourceArgument,
    *,
    library: LibraryOption = Path("objects"),
    want: WantOption = None,
    budget: BudgetOption = None,
    task_file: Annotated[
        Path | None,
        typer.Option(
            help="Task (TOML: budget [s], others, table priorities) instead of --want; read again "
            "whenever it changes.",
            rich_help_panel=TASK_PANEL,
        ),
    ] = None,
    view: Annotated[
        bool, typer.Option("--view", help="Show it in Rerun.", rich_help_panel=_SHOWING)
    ] = False,
    web: Annotated[
        bool, typer.Option("--web", help="Show it in a browser.", rich_help_panel=_SHOWING)
    ] = False,
    rrd: Annotated[
        Path | None,
        typer.Option(help="New recording for the Rerun viewer.", rich_help_panel=_SHOWING),
    ] = None,
    image_rate: Annotated[
        float,
        typer.Option(
            min=0,
            max=1000,
            help="Images and clouds shown a second, at most; 0 for none.",
            rich_help_panel=_SHOWING,
        ),
    ] = 10.0,
    port: Annotated[
        int,
        typer.Option(min=1, max=65535, help="Of the viewer's data.", rich_help_panel=_SHOWING),
    ] = 9876,
    web_port: Annotated[
        int,
        typer.Option(min=1, max=65535, help="Of the page of --web.", rich_help_panel=_SHOWING),
    ] = 9090,
    open_browser: Annotated[
        bool,
        typer.Option(
            "--browser/--no-browser", help="Open a browser for --web.", rich_help_panel=_SHOWING
        ),
    ] = True,
    record: Annotated[
        Path | None,
        typer.Option(
            help="New file for what is seen: JSON Lines, one frame a line.",
            metavar="FILE",
            rich_help_panel=_RECORDING,
        ),
    ] = None,
    record_frames: Annotated[
        Path | None,
        typer.Option(
            help="New recording of the frames: NAME.mcap, else a folder.",
            metavar="NAME",
            rich_help_panel=_RECORDING,
        ),
    ] = None,
    log: Annotated[Path | None, log_option(_RECORDING)] = None,
    log_color: LogColorOption = "png",
    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="Serve it to Foxglove.", rich_help_panel=_FOXGLOVE)
    ] = False,
    foxglove_address: Annotated[
        str | None,
        typer.Option(
            help="The same, at another address; whoever can connect sees everything.",
            metavar="HOST:PORT",
            show_default="127.0.0.1:8765",
            rich_help_panel=_FOXGLOVE,
        ),
    ] = None,
    frames: FramesOption = None,
    seconds: SecondsOption = None,
    pace: Annotated[
        bool,
        typer.Option(
            help="Play a recording at its own speed, as if it were a camera; else wait for every "
            "frame and its detection: none is dropped, and each run gives the same."
        ),
    ] = True,
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
    """Find taught objects and follow them in every frame, until Ctrl-C or the source's end.

    A camera that is unplugged is waited for. A viewer that is closed and a disk that is full are
    reported, and tracking goes on; exit code 1 says that a recording is not complete.

        planegrasp live realsense --view

        planegrasp live run.mcap --want book=2 --want box --record seen.jsonl --rrd seen.rrd

        planegrasp live realsense --foxglove --log run.mcap
    """
    from planegrasp.cli.live_open import begin_foxglove, begin_view, open_outputs
    from planegrasp.cli.live_run import LiveRun
    from planegrasp.cli.live_status import StatusLine
    from planegrasp.cli.stopping import stop_on_signals
    from planegrasp.detector import Detector
    from planegrasp.io.cameras import NewestFrame, StreamConfig
    from planegrasp.live import Live, LiveConfig, TaskFile

    if sum((view, web, rrd is not None)) > 1:
        raise InvalidInputError("--view, --web and --rrd exclude each other: give one of them")
    if task_file is not None and want:
        raise InvalidInputError("--want and --task-file exclude each other: give one of them")
    models = tuple(wanted_models(library))
    task = task_of(want or [], budget)
    changes = None
    if task_file is not None:
        changes = TaskFile(task_file, [model.name for model in models], task.budget)
        task = changes.changed() or task
    with ExitStack() as stack:
        stop = stack.enter_context(stop_on_signals())
        opened = open_frames(
            source,
            camera=camera,
            fov=fov,
            depth_scale=depth_scale,
            mode=(width, height, fps),
            topics=(color_topic, depth_topic, info_topic),
        )
        with messages().status("learning the objects …"):
            detector = Detector(models)
        # Without a pace, waiting for the detector costs nothing but time.
        finder = stack.enter_context(Live(detector, task, LiveConfig(background=pace)))
        view_of = begin_view(view, web, rrd, port, web_port, opens=open_browser)
        log_of = (
            begin_foxglove(
                stack,
                models,
                foxglove_address or ("" if foxglove else None),
                log,
                # A log has every image.
                foxglove_config(log_color, image_rate if log is None else None),
                wait=not pace,
            )
            if foxglove or foxglove_address or log
            else None
        )
        stream = stack.enter_context(NewestFrame(opened, StreamConfig(pace=pace)))
        outputs = open_outputs(
            stack,
            view_of(),
            models,
            image_rate=image_rate,
            lines=record,
            frames=record_frames,
            wait=not pace,
        )
        if log_of is not None:
            outputs.append(stack.enter_context(log_of(opened)))
        status = stack.enter_context(StatusLine())
        for note in stream.notes:
            status.event("note", note, "yellow")
        run = LiveRun(source, finder, stream, outputs, status, changes, frames, seconds)
        try:
            run.run(stop)
        finally:
            run.finish()
    if as_json:
        print_json(run.to_dict())
    else:
        run.print_summary()
    if run.hangs:
        # Rerun at the exit of the program waits without end for a viewer that is stuck, and
        # foxglove-sdk for its writer.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(int(run.failed))
    if run.failed:
        raise typer.Exit(1)
