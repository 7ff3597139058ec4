"""`planegrasp demo`: teach, find, grasp and compare with the truth; no camera, no download."""

from __future__ import annotations

import math
import time
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.cli.common import JsonOption, console, print_error, print_json
from planegrasp.errors import MissingExtraError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.console import Console
    from rich.table import Table

    from planegrasp.demo import Demo, DemoOutcome, ObjectScore
    from planegrasp.demo.grasping import GraspDemo, Performance
    from planegrasp.objects import ObjectModel
    from planegrasp.teaching.quality import TeachingQuality


class Part(StrEnum):
    """Half of the demonstration."""

    FIND = "find"
    GRASP = "grasp"


def demo(
    *,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for everything that is written.")
    ] = Path("out/demo"),
    frames: Annotated[int, typer.Option(min=2, help="How many to render.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="Of the sensors' noise.")] = 0,
    only: Annotated[
        Part | None,
        typer.Option(help="One half of it: find objects, or grasp them.", show_default="both"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Teach objects by photographs, find them, and let a simulated robot grasp two of them.

    Needs no camera, no display and no network. Finds three objects in rendered frames and compares
    with the truth. Then shows a PR2 grasps of a box and a book, and lets it do them: the box on a
    tripod, the book in a moving hand (needs the extra `robot`). Writes the library, the frames,
    pictures, JSON Lines and Rerun recordings. Exit code 1 if an object is missed, a pose is worse
    than it should be, or a grasp fails.

        planegrasp demo --output out/demo

        planegrasp demo --only grasp
    """
    from rich.console import Console

    started = time.perf_counter()
    out = Console(quiet=True) if as_json else console()
    messages = Console(stderr=True, highlight=False)
    result: dict[str, object] = {"output": str(output), "seed": seed}
    faults: list[str] = []
    outcome = performances = None
    finding = _finding(output, frames, seed) if only is not Part.GRASP else None
    grasping = _grasping(output, seed) if only is not Part.FIND else None
    if only is Part.GRASP and grasping is None:
        raise MissingExtraError("the demo's robot", "robot")
    _teach(finding, grasping, out, messages)
    if finding is not None:
        outcome = _find(finding, out, messages)
        result |= _result(finding, outcome)
        faults += outcome.faults
    if grasping is not None:
        from planegrasp.cli.demo_grasps import grasps_result, show_and_grasp

        shown, performances = show_and_grasp(grasping, out, messages, 2 if finding is None else 3)
        result["grasping"] = grasps_result(shown, performances)
        faults += [fault for performance in performances for fault in performance.faults]
    elif only is None:
        from planegrasp.cli.demo_grasps import WITHOUT_ROBOT

        out.print(WITHOUT_ROBOT)
    _print_written(out, output, outcome, performances)
    out.print(f"[dim]{time.perf_counter() - started:.0f} s in all[/]")
    if as_json:
        print_json({**result, "faults": faults})
    for fault in faults:
        print_error(fault)
    if faults:
        raise typer.Exit(1)


def _finding(output: Path, frames: int, seed: int) -> Demo:
    from planegrasp.demo import Demo

    return Demo(output, frames, seed)


def _grasping(output: Path, seed: int) -> GraspDemo | None:
    """None where the extra `robot` is not installed."""
    try:
        import planegrasp.robot  # noqa: F401
    except MissingExtraError:
        return None
    from planegrasp.demo.grasping import GraspDemo

    return GraspDemo(output, seed)


def _teach(
    finding: Demo | None, grasping: GraspDemo | None, out: Console, messages: Console
) -> None:
    out.print("[bold]1. Teach[/]: a photo of each face, and its width")
    models: list[ObjectModel] = []
    qualities: dict[str, dict[str, TeachingQuality]] = {}
    with messages.status("teaching …"):
        if finding is not None:
            qualities |= finding.teach()
            models += finding.models
        if grasping is not None:
            qualities |= grasping.teach()
            models += [thing.model for thing in grasping.things]
    out.print(_taught(models, qualities))


def _find(show: Demo, out: Console, messages: Console) -> DemoOutcome:
    from planegrasp.cli.progress import frame_progress

    with messages.status("learning how the faces look from the side …"):
        detector = show.detector()
    out.print(f"[bold]2. Find[/] them in {show.frames} rendered RGB-D frames")
    with frame_progress("rendering and finding", show.frames) as advance:
        outcome = show.run(detector, advance)
    out.print(_scores(outcome.scores))
    out.print(
        f"  {outcome.detection_ms:.0f} ms to find all objects in a frame (median)   "
        f"{outcome.false_detections} false detections\n"
    )
    return outcome


def _taught(
    models: Sequence[ObjectModel], qualities: Mapping[str, Mapping[str, TeachingQuality]]
) -> Table:
    table = _table()
    table.add_column("object")
    table.add_column("face")
    for heading in ("size, mm", "features", "quality"):
        table.add_column(heading, justify="right")
    for model in models:
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


def _print_written(
    out: Console,
    path: Path,
    outcome: DemoOutcome | None,
    performances: Sequence[Performance] | None,
) -> None:
    from rich.table import Table

    written = Table.grid(padding=(0, 3, 0, 0))
    written.add_column(no_wrap=True, style="cyan")
    written.add_column()
    not_written = r"not written: pip install 'planegrasp\[rerun]'"
    files: dict[str, str] = {}
    if performances is not None:
        files["grasp.png"] = "the grasps, as the robot and others saw them"
        for performance in performances:
            what = "what the robot did and saw, for the Rerun viewer"
            files[f"{performance.act.name}.rrd"] = what if performance.recording else not_written
    if outcome is not None:
        files |= {
            "filmstrip.png": "four frames with what was found",
            "found": "every frame",
            "found.jsonl": "poses as JSON Lines",
            "found.rrd": "poses in the depth clouds" if outcome.has_recording else not_written,
            "recording": "the frames themselves, with the truth",
        }
    files["objects"] = "the taught objects" + ("" if performances is None else ", with grasps")
    for file, what in files.items():
        written.add_row(f"  {path / file}", what)
    out.print("\n[bold]Written[/]")
    out.print(written)
    library = f"--library {path / 'objects'}"
    out.print("\n[bold]Next[/]")
    if outcome is not None:
        _print_command(out, f"planegrasp detect {path / 'recording'} {library} --explain")
    if performances is not None:
        _print_command(out, f"planegrasp grasp list {library}")
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
        "frames": show.frames,
        "objects": scores,
        "false_detections": outcome.false_detections,
        "detection_ms_median": outcome.detection_ms,
        "comparisons": [comparison.to_dict() for comparison in outcome.comparisons],
    }


def _table() -> Table:
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
