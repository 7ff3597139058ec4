"""`planegrasp detect`: find a library's objects in images, videos and RGB-D recordings."""

from __future__ import annotations

import math
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planegrasp.cli.common import JsonOption, LibraryOption, console, print_json, wanted_models
from planegrasp.cli.detection_tables import explanation, print_summary
from planegrasp.cli.foxglove_options import LogColorOption, foxglove_config, log_option
from planegrasp.cli.source_options import (
    ColorTopicOption,
    DepthTopicOption,
    InfoTopicOption,
    recording_topics,
)
from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rich.console import Console

    from planegrasp.detection import DetectionReport
    from planegrasp.detector import Detector
    from planegrasp.io.sinks import Summary
    from planegrasp.io.sources import FrameSource
    from planegrasp.objects import ObjectModel
    from planegrasp.results import ResultSink
    from planegrasp.rgbd import RGBDFrame

_TO_OUTPUT = "-"


def detect(
    source: Annotated[
        Path,
        typer.Argument(
            help="An image, a folder of images, a video, a folder with an RGB-D recording "
            "(color/ + depth/ + camera.json, TUM RGB-D, BOP), or a recording of ROS or for "
            "Foxglove (bag, MCAP).",
            show_default=False,
        ),
    ],
    *,
    library: LibraryOption = Path("objects"),
    camera: Annotated[
        Path | None, typer.Option(help="Camera file (JSON).", show_default="of the source")
    ] = None,
    depth: Annotated[
        Path | None,
        typer.Option(help="Depth image of an image, or folder of depth images of a folder."),
    ] = None,
    depth_scale: Annotated[
        float | None,
        typer.Option(help="Metres per unit of the depth images.", show_default="of the source"),
    ] = None,
    fov: Annotated[
        float | None,
        typer.Option(
            help="Horizontal field of view in degrees, where there is no camera file.",
            show_default="60",
        ),
    ] = None,
    color_topic: ColorTopicOption = None,
    depth_topic: DepthTopicOption = None,
    info_topic: InfoTopicOption = None,
    only: Annotated[
        list[str] | None,
        typer.Option("--object", help="Look for this object only; may be repeated."),
    ] = None,
    max_frames: Annotated[
        int | None, typer.Option(min=1, help="Stop after so many frames.", show_default="all")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for the frames with what was found drawn in."),
    ] = None,
    jsonl: Annotated[
        str | None,
        typer.Option(help="JSON Lines, one frame a line; - is standard output.", metavar="FILE|-"),
    ] = None,
    rrd: Annotated[Path | None, typer.Option(help="Recording for the Rerun viewer.")] = None,
    log: Annotated[Path | None, log_option()] = None,
    log_color: LogColorOption = "png",
    explain: Annotated[
        bool,
        typer.Option("--explain", help="Say for every face where the search stopped, and why."),
    ] = False,
    extractor: Annotated[
        str, typer.Option(help="Of features: sift, surf, akaze, brisk or orb.", metavar="NAME")
    ] = "sift",
    matcher: Annotated[
        str | None,
        typer.Option(
            help="flann-kdtree, flann-kmeans, flann-lsh or brute-force.",
            metavar="NAME",
            show_default="by the extractor",
        ),
    ] = None,
    pose: Annotated[
        str, typer.Option(help="Method: fused, pnp or three_point.", metavar="NAME")
    ] = "fused",
    as_json: JsonOption = False,
) -> None:
    """Find taught objects and their poses in the camera's frame.

    Exit code 0 means that every frame was searched, whether or not something was found.

    One photo, and why an object is not found in it:

        planegrasp detect desk.jpg --camera camera.json --explain

    A recording, with pictures, results a frame a line, and a Rerun recording:

        planegrasp detect recording/ --output found/ --jsonl found.jsonl --rrd found.rrd
    """
    from planegrasp.detector import Detector, DetectorConfig
    from planegrasp.io.sinks import Summary
    from planegrasp.io.sources import open_source

    if as_json and jsonl == _TO_OUTPUT:
        raise InvalidInputError("--json and --jsonl - both want standard output: give one of them")
    models = wanted_models(library, only)
    frames = open_source(
        source,
        camera=camera,
        depth=depth,
        depth_scale=depth_scale,
        field_of_view=None if fov is None else math.radians(fov),
        topics=recording_topics(color_topic, depth_topic, info_topic),
    )
    messages = _messages()
    for note in frames.notes:
        messages.print(f"[yellow]note:[/] {note}", soft_wrap=True)
    config = DetectorConfig(extractor=extractor, matcher=matcher or "", pose=pose)
    with messages.status("learning the objects …"):
        detector = Detector(models, config)
    run = _Run(explain=explain, keep=as_json)
    summary = Summary(model.name for model in models)
    out = messages if jsonl == _TO_OUTPUT or as_json else console()
    with ExitStack() as stack:
        sinks = [stack.enter_context(s) for s in _sinks(models, output, jsonl, rrd)]
        if log is not None:
            sinks.append(stack.enter_context(_log(log, models, log_color)))
        run.search(detector, frames, [summary, *sinks], out, max_frames)
    if as_json:
        print_json(run.to_dict(frames.name, summary))
    else:
        print_summary(out, frames.name, summary, run.seconds, explained=explain)


class _Run:
    """The loop over the frames, and what is remembered of it."""

    def __init__(self, *, explain: bool, keep: bool) -> None:
        self.seconds: dict[str, float] = {}
        self._explain = explain
        self._keep = keep
        self._results: list[dict[str, Any]] = []

    def search(
        self,
        detector: Detector,
        frames: FrameSource,
        sinks: Iterable[ResultSink],
        out: Console,
        max_frames: int | None,
    ) -> None:
        """Detect in every frame, hand the results to the sinks, and print the reports if asked."""
        for frame in _with_progress(frames, max_frames):
            started = time.perf_counter()
            report = detector.explain(frame)
            took = {**report.seconds, "total": time.perf_counter() - started}
            for stage, seconds in took.items():
                self.seconds[stage] = self.seconds.get(stage, 0.0) + seconds
            for sink in sinks:
                sink.write(frame, report.detections)
            if self._keep:
                self._results.append(self._result(frame, report))
            elif self._explain:
                out.print(explanation(frame, report))

    def to_dict(self, source: str, summary: Summary) -> dict[str, Any]:
        """Everything as one JSON object."""
        return {
            "source": source,
            "frames": summary.frames,
            "seconds_per_frame": {k: v / summary.frames for k, v in self.seconds.items()},
            "objects": [entry.to_dict(summary.frames) for entry in summary.objects],
            "results": self._results,
        }

    def _result(self, frame: RGBDFrame, report: DetectionReport) -> dict[str, Any]:
        from planegrasp.io.sinks import face_report_to_dict, frame_to_dict

        result = frame_to_dict(frame, report.detections)
        if self._explain:
            result["faces"] = [face_report_to_dict(face) for face in report.faces]
        return result


def _sinks(
    models: Iterable[ObjectModel], output: Path | None, jsonl: str | None, rrd: Path | None
) -> Iterator[ResultSink]:
    from planegrasp.io.sinks import AnnotatedImageWriter, JsonLinesWriter
    from planegrasp.viz.palette import object_colors

    models = tuple(models)
    colors = object_colors(model.name for model in models)
    if output is not None:
        yield AnnotatedImageWriter(output, colors)
    if jsonl is not None:
        yield JsonLinesWriter(sys.stdout if jsonl == _TO_OUTPUT else jsonl)
    if rrd is not None:
        from planegrasp.viz.rerun_recording import RerunRecording

        yield RerunRecording(rrd, models, colors)


def _log(path: Path, models: Iterable[ObjectModel], color: str) -> ResultSink:
    config = foxglove_config(color)
    from planegrasp.io.foxglove import DetectionsLog

    return DetectionsLog(path, models, config)


def _messages() -> Console:
    """Where progress and notes go: standard error."""
    from rich.console import Console

    return Console(stderr=True, highlight=False)


def _with_progress(frames: FrameSource, max_frames: int | None) -> Iterator[RGBDFrame]:
    """The frames, at most so many, behind a progress bar where there is a terminal and a need."""
    from itertools import islice

    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    limits = [n for n in (frames.length, max_frames) if n is not None]
    total = min(limits) if limits else None
    messages = _messages()
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=messages,
        disable=not messages.is_terminal or total == 1,
        transient=True,
    ) as progress:
        task = progress.add_task(frames.name, total=total)
        for frame in islice(frames, max_frames):
            yield frame
            progress.advance(task)
