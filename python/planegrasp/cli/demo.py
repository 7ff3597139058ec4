"""`planegrasp demo`: teach, find and compare with the truth, without a camera or a download."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.cli.common import JsonOption, console, print_error, print_json

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.console import Console
    from rich.table import Table

    from planegrasp.demo import Comparison, Demo, DemoOutcome, ObjectScore
    from planegrasp.geometry import RigidTransform
    from planegrasp.teaching.quality import TeachingQuality


def demo(
    *,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for everything that is written.")
    ] = Path("out/demo"),
    frames: Annotated[int, typer.Option(min=2, help="How many to render.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="Of the sensors' noise.")] = 0,
    as_json: JsonOption = False,
) -> None:
    """Teach three objects from photographs, find them in rendered frames, compare with the truth.

    Needs no camera, no display and no network. Writes the library, the frames, pictures of what
    was found, JSON Lines and a Rerun recording. Exit code 1 if an object is missed or a pose is
    worse than it should be.

        planegrasp demo --output out/demo
    """
    from rich.console import Console

    from planegrasp.cli.progress import frame_progress
    from planegrasp.demo import Demo

    started = time.perf_counter()
    out = Console(quiet=True) if as_json else console()
    messages = Console(stderr=True, highlight=False)
    show = Demo(output, frames, seed)

    out.print("[bold]1. Teach[/]: a photo of each face, and its width")
    with messages.status("teaching …"):
        qualities = show.teach()
    out.print(_taught(show, qualities))
    with messages.status("learning how the faces look from the side …"):
        detector = show.detector()

    out.print(f"[bold]2. Find[/] them in {frames} rendered RGB-D frames with the noise of a Kinect")
    with frame_progress("rendering and finding", frames) as advance:
        outcome = show.run(detector, advance)
    out.print(_scores(outcome.scores))
    out.print(
        f"  {outcome.detection_ms:.0f} ms to find all objects in a frame (median)   "
        f"{outcome.false_detections} false detections\n"
    )

    out.print("[bold]3. Compare[/] with the truth, here in the frame where most is hidden")
    out.print(_comparison(outcome.frame_to_show()))
    _print_written(out, show, outcome)
    out.print(f"[dim]{time.perf_counter() - started:.0f} s in all[/]")
    if as_json:
        print_json(_result(show, outcome))
    for fault in outcome.faults:
        print_error(fault)
    if outcome.faults:
        raise typer.Exit(1)


def _taught(show: Demo, qualities: Mapping[str, Mapping[str, TeachingQuality]]) -> Table:
    table = _table()
    table.add_column("object")
    table.add_column("face")
    for heading in ("size, mm", "features", "quality"):
        table.add_column(heading, justify="right")
    for model in show.models:
        for i, face in enumerate(model.faces):
            quality = qualities[model.name][face.name]
            table.add_row(
                model.name if i == 0 else "",
                face.name,
                f"{1e3 * face.width:.0f} × {1e3 * face.height:.0f}",
                f"{quality.figures['features']:.0f}",
                f"{quality.score} of 100",
            )
    return table


def _scores(scores: Sequence[ObjectScore]) -> Table:
    table = _table()
    table.add_column("object")
    for heading in (
        "found",
        "tilted\nup to",
        "hidden\nup to",
        "position error, mm\nmedian  largest",
        "rotation error, °\nmedian  largest",
    ):
        table.add_column(heading, justify="right")
    for score in scores:
        table.add_row(
            score.name,
            f"{score.found}/{score.frames}",
            f"{score.largest_tilt_deg:.0f}°",
            f"{1 - score.least_visible:.0%}",
            f"{score.median_mm:.2f}  {score.worst_mm:7.2f}",
            f"{score.median_deg:.2f}  {score.worst_deg:7.2f}",
        )
    return table


def _comparison(comparisons: Sequence[Comparison]) -> Table:
    table = _table()
    table.add_column("object")
    table.add_column("")
    for heading in ("x, y, z, mm", "roll, pitch, yaw, °", "error"):
        table.add_column(heading, justify="right", no_wrap=True)
    for comparison in comparisons:
        hidden = f"{1 - comparison.visible:.0%} hidden" if comparison.visible < 0.995 else ""
        table.add_row(comparison.name, "true", *_pose_cells(comparison.truth), "")
        if comparison.estimate is None:
            table.add_row(hidden, "found", "–", "–", "not found", end_section=True)
            continue
        error = f"{comparison.translation_mm:.2f} mm {comparison.rotation_deg:.2f}°"
        table.add_row(hidden, "found", *_pose_cells(comparison.estimate), error, end_section=True)
    return table


def _pose_cells(pose: RigidTransform) -> tuple[str, str]:
    from planegrasp.geometry import euler_from_rotation

    position = " ".join(f"{1e3 * v:6.1f}" for v in pose.translation)
    angles = " ".join(f"{math.degrees(v):6.1f}" for v in euler_from_rotation(pose.rotation))
    return position, angles


def _print_written(out: Console, show: Demo, outcome: DemoOutcome) -> None:
    from rich.table import Table

    written = Table.grid(padding=(0, 3, 0, 0))
    written.add_column(no_wrap=True, style="cyan")
    written.add_column()
    path = show.path
    files = {
        path / "filmstrip.png": "four frames with what was found",
        path / "found": "every frame",
        path / "found.jsonl": "poses as JSON Lines",
        path / "found.rrd": "poses in the depth clouds, for the Rerun viewer",
        path / "recording": "the frames themselves, with the truth",
        path / "objects": "the taught objects",
    }
    if not outcome.has_recording:
        files[path / "found.rrd"] = "not written: pip install 'planegrasp[rerun]'"
    for file, what in files.items():
        written.add_row(f"  {file}", what)
    out.print("[bold]Written[/]")
    out.print(written)
    out.print("\n[bold]Next[/]: find them again, and say why when something is not found")
    _print_command(
        out, f"planegrasp detect {path / 'recording'} --library {show.library_path} --explain"
    )
    out.print("then teach something of your own with a photo and its width in metres")
    _print_command(out, "planegrasp teach book book.jpg --width 0.21")
    _print_command(out, "planegrasp detect desk.jpg --camera camera.json --output found")


def _print_command(out: Console, command: str) -> None:
    out.print(f"  [green]{command}[/]", soft_wrap=True)


def _result(show: Demo, outcome: DemoOutcome) -> dict[str, object]:
    """Everything as one JSON object; a number without a value is null."""
    from dataclasses import asdict

    scores = [
        {k: v if isinstance(v, (str, int)) or math.isfinite(v) else None for k, v in row.items()}
        for row in (asdict(score) for score in outcome.scores)
    ]
    return {
        "output": str(show.path),
        "frames": show.frames,
        "seed": show.seed,
        "objects": scores,
        "false_detections": outcome.false_detections,
        "detection_ms_median": outcome.detection_ms,
        "faults": list(outcome.faults),
        "comparisons": [comparison.to_dict() for comparison in outcome.comparisons],
    }


def _table() -> Table:
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
