"""Benchmarks of detection and pose, on single frames."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer

from planegrasp.cli.bench_options import (
    FramesOption,
    JsonFileOption,
    PlotOption,
    QuickOption,
    SeedOption,
    chosen,
    measure,
    names,
)

__all__ = ["estimators", "negatives", "objects", "pose", "recorded", "speed", "tilt"]


def tilt(
    *,
    extractors: Annotated[
        str | None,
        typer.Option(
            help="Which, separated by commas: sift and surf (with oblique views), sift_plain, "
            "surf_plain, akaze, brisk, orb.",
            metavar="A,B",
            show_default="all",
        ),
    ] = None,
    frames: FramesOption = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
    plot: PlotOption = None,
) -> None:
    """Recall against out-of-plane rotation for each extractor (the paper's Table I), and its ε."""
    from planegrasp.bench import tilt as bench

    compared = names(extractors, tuple(bench.EXTRACTORS)) if extractors is not None else None
    settings = chosen(bench.TiltSettings, quick=quick, frames=frames, extractors=compared)
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file, plot)


def objects(
    *,
    frames: FramesOption = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
    plot: PlotOption = None,
) -> None:
    """Detection time for 1 … 6 objects (the paper's Table II), then for larger libraries."""
    from planegrasp.bench import objects as bench

    settings = chosen(bench.ObjectsSettings, quick=quick, frames=frames)
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file, plot)


def speed(
    *,
    frames: FramesOption = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """Time per stage and per frame against OpenCV's SIFT, FLANN and RANSAC; one thread and all."""
    from planegrasp.bench import speed as bench

    settings = chosen(bench.SpeedSettings, quick=quick, frames=frames)
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


def pose(
    *,
    frames: FramesOption = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
    plot: PlotOption = None,
) -> None:
    """Pose error against tilt, distance and occlusion, and that of a marker of the same size."""
    from planegrasp.bench import pose as bench

    settings = chosen(bench.PoseSettings, quick=quick, frames=frames)
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file, plot)


def negatives(
    *,
    data: Annotated[
        Path | None,
        typer.Option(help="Recorded frames that show none of the objects.", metavar="DIR"),
    ] = None,
    extractor: Annotated[
        str, typer.Option(help="sift, surf, akaze, brisk, orb or opencv-sift.", metavar="NAME")
    ] = "sift",
    frames: Annotated[
        int | None, typer.Option(min=1, help="Rendered frames.", show_default="of the bench")
    ] = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """False positives on frames that show none of the taught objects."""
    from planegrasp.bench import negatives as bench
    from planegrasp.features import make_extractor

    make_extractor(extractor)  # an unknown one is refused before anything is measured
    settings = chosen(
        bench.NegativesSettings, quick=quick, data=data, extractor=extractor, frames=frames
    )
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


def recorded(
    *,
    data: Annotated[
        Path,
        typer.Option(
            help="Recording with color/, depth/, camera.json and ground_truth.json.",
            metavar="DIR",
            show_default=False,
        ),
    ],
    frames: Annotated[
        int | None, typer.Option(min=1, help="At most so many frames.", show_default="all")
    ] = None,
    calibrate: Annotated[
        bool,
        typer.Option(
            "--calibrate",
            help="Where camera.json has no lens distortion, take it from what stands still.",
        ),
    ] = False,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """Recall and pose error on a recorded sequence with ground truth."""
    from planegrasp.bench import recorded as bench

    settings = bench.RecordedSettings.quick(data) if quick else bench.RecordedSettings(data)
    if frames:
        settings = replace(settings, max_frames=frames)
    settings = replace(settings, calibrate=calibrate)
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


def estimators(
    *,
    frames: FramesOption = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """Robust homography estimators of OpenCV, PoseLib and kornia-rs on the same matches."""
    from planegrasp.bench import estimators as bench

    settings = chosen(bench.EstimatorsSettings, quick=quick, frames=frames)
    measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)
