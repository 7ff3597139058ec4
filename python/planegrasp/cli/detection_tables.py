"""What `planegrasp detect` prints: a summary of all frames, and why faces were not found."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import Console
    from rich.table import Table

    from planegrasp.detection import DetectionReport
    from planegrasp.io.sinks import ObjectSummary, Summary
    from planegrasp.rgbd import RGBDFrame


def print_summary(
    out: Console, source: str, summary: Summary, seconds: Mapping[str, float], *, explained: bool
) -> None:
    """Print a table of the objects, the time a frame took, and what was not found.

    Args:
        out: where to print.
        source: name of the frame source.
        summary: of all frames.
        seconds: by stage, of all frames together; with a key "total".
        explained: whether the user has been told already why objects were not found.
    """
    out.print(_summary_table(source, summary))
    if summary.frames:
        per_frame = {stage: 1000 * spent / summary.frames for stage, spent in seconds.items()}
        total = per_frame.pop("total")
        stages = ", ".join(f"{stage} {spent:.0f}" for stage, spent in per_frame.items())
        out.print(f"[dim]{total:.0f} ms a frame ({stages})[/]")
    for entry in summary.objects:
        if entry.last is not None and entry.last.pose is None:
            out.print(f"{entry.name} has no pose: {entry.last.pose_failure}", soft_wrap=True)
    missing = [entry.name for entry in summary.objects if not entry.frames_found]
    if missing:
        hint = "" if explained else " (--explain says why)"
        out.print(f"not found: {', '.join(missing)}{hint}", soft_wrap=True)


def explanation(frame: RGBDFrame, report: DetectionReport) -> Table:
    """Where the search for each face stopped in one frame, with its numbers and the reason."""
    from rich.text import Text

    table = _table(f"frame {frame.name}")
    for heading in ("object", "face", "stopped at", "figures", "why"):
        table.add_column(heading, overflow="fold")
    for face in report.faces:
        figures = ", ".join(f"{name} {value:.4g}" for name, value in face.figures.items())
        stage = Text("found", "green") if face.found else Text(face.stage, "yellow")
        title = _title(face.object, face.instance)
        table.add_row(title, face.face, stage, figures, Text(face.reason))
    return table


def _summary_table(source: str, summary: Summary) -> Table:
    one = summary.frames == 1
    table = _table(f"{source}, {'1 frame' if one else f'{summary.frames} frames'}")
    table.add_column("object", overflow="fold")
    for heading in ("found", "inliers", "m away", "x, y, z, m", "roll, pitch, yaw, °"):
        table.add_column(heading, justify="right", no_wrap=True)
    if not one:
        table.caption = (
            "mean inliers, median distance, pose in the last frame in which it was found"
        )
        table.caption_justify = "left"
    for entry in summary.objects:
        style = None if entry.frames_found else "dim"
        table.add_row(*_summary_cells(entry, summary.frames), style=style)
    return table


def _summary_cells(entry: ObjectSummary, frames: int) -> tuple[str, ...]:
    figures = entry.to_dict(frames)
    inliers, distance = figures["mean_inliers"], figures["median_distance"]
    position, angles = "–", "–"
    if entry.last is not None and entry.last.pose is not None and entry.last.euler is not None:
        position = " ".join(f"{v:6.3f}" for v in entry.last.pose.T_camera_object.translation)
        angles = " ".join(f"{math.degrees(v):6.1f}" for v in entry.last.euler)
        if entry.last.ambiguous:
            angles += " or other"
    return (
        _title(entry.name, entry.instance),
        f"{entry.frames_found}/{frames}",
        "–" if inliers is None else f"{inliers:.0f}",
        "–" if distance is None else f"{distance:.3f}",
        position,
        angles,
    )


def _title(name: str, instance: int) -> str:
    return name + (f" #{instance + 1}" if instance else "")


def _table(title: str) -> Table:
    from rich import box
    from rich.table import Table

    return Table(title=title, box=box.SIMPLE_HEAD, title_justify="left", padding=(0, 1, 0, 0))
