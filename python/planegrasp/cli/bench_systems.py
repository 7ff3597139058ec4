"""Benchmarks of what goes on over time: grasps, the live system, ROS 2."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer

from planegrasp.cli.bench_options import (
    JsonFileOption,
    QuickOption,
    SeedOption,
    chosen,
    measure,
    names,
)

__all__ = ["grasp", "live", "ros2", "soak"]


def grasp(
    *,
    static: Annotated[
        int | None, typer.Option(min=0, help="Poses on a tripod.", show_default="300")
    ] = None,
    handheld: Annotated[
        int | None, typer.Option(min=0, help="Poses in a hand.", show_default="150")
    ] = None,
    sides: Annotated[
        str | None,
        typer.Option(
            help="Grasps that are taught, separated by commas: side, top, left, bottom.",
            metavar="A,B",
            show_default="all",
        ),
    ] = None,
    jobs: Annotated[
        int | None, typer.Option(min=1, help="Processes.", show_default="one a core")
    ] = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """Grasps of a simulated PR2: success, refusals and failures, on a tripod and hand-held."""
    from planegrasp.bench import grasp as bench

    taught = names(sides, bench.SIDES, "--sides") if sides is not None else None
    settings = chosen(
        bench.GraspSettings,
        quick=quick,
        static=static,
        handheld=handheld,
        sides=taught,
        jobs=jobs,
    )
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


def live(
    *,
    repeats: Annotated[
        int | None, typer.Option(min=1, help="Streams of each kind.", show_default="2")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(min=2.0, help="Length of a stream [s].", show_default="15")
    ] = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """Tracking against detection; the live system on streams of 1, 3 and 10 objects."""
    from planegrasp.bench import live as bench

    settings = chosen(bench.LiveSettings, quick=quick, repeats=repeats, seconds=seconds)
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


def soak(
    *,
    frames: Annotated[
        int | None, typer.Option(min=1000, help="Frames to track.", show_default="100000")
    ] = None,
    losses: Annotated[
        int | None,
        typer.Option(min=1, help="How often the camera drops out.", show_default="100"),
    ] = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """The live system left running: growth of memory and threads, a camera that drops out."""
    from planegrasp.bench import soak as bench

    settings = chosen(bench.SoakSettings, quick=quick, frames=frames, losses=losses)
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


def ros2(
    *,
    frames: Annotated[
        int | None,
        typer.Option(min=100, help="Frames to publish.", show_default="10000, at 30 Hz"),
    ] = None,
    kills: Annotated[
        int | None, typer.Option(min=0, help="How often the peer is killed.", show_default="20")
    ] = None,
    peer: Annotated[
        Path | None,
        typer.Option(
            help="Program of the peer: ros2/proof/target/release/ros2-peer.",
            metavar="FILE",
            show_default="one in Python, on the same DDS",
            exists=True,
            dir_okay=False,
            resolve_path=True,
        ),
    ] = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """What ROS 2 adds to the latency; a listener that is killed and started again."""
    from planegrasp.bench import ros2 as bench

    settings = chosen(bench.Ros2Settings, quick=quick, frames=frames, kills=kills, program=peer)
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)
