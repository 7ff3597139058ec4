"""`planegrasp bench NAME`: the measurements that docs/benchmarks.md defines."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.cli.common import console
from planegrasp.errors import InvalidInputError, MissingExtraError

if TYPE_CHECKING:
    from collections.abc import Callable

    from planegrasp.bench.result import BenchResult

    Run = Callable[[Callable[[], None]], BenchResult]

app = typer.Typer(
    help="Measure recall, accuracy and time on rendered or recorded frames with known truth.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)

SeedOption = Annotated[int, typer.Option(min=0, help="Of everything random.")]
QuickOption = Annotated[
    bool, typer.Option("--quick", help="Under a minute: no more than an impression.")
]
FramesOption = Annotated[
    int | None, typer.Option(min=1, help="Frames of each condition.", show_default="of the bench")
]
JsonFileOption = Annotated[
    Path | None,
    typer.Option("--json", help="Write table and figures as JSON.", metavar="FILE"),
]
PlotOption = Annotated[
    Path | None, typer.Option(help="Draw the result as a picture.", metavar="FILE.png")
]


@app.command()
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

    settings = bench.TiltSettings.quick() if quick else bench.TiltSettings()
    if frames:
        settings = replace(settings, frames=frames)
    if extractors is not None:
        settings = replace(settings, extractors=_names(extractors, tuple(bench.EXTRACTORS)))
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file, plot)


@app.command()
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

    settings = bench.ObjectsSettings.quick() if quick else bench.ObjectsSettings()
    if frames:
        settings = replace(settings, frames=frames)
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file, plot)


@app.command()
def speed(
    *,
    frames: FramesOption = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """Time per stage and per frame against OpenCV's SIFT, FLANN and RANSAC; one thread and all."""
    from planegrasp.bench import speed as bench

    settings = bench.SpeedSettings.quick() if quick else bench.SpeedSettings()
    if frames:
        settings = replace(settings, frames=frames)
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


@app.command()
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

    settings = bench.PoseSettings.quick() if quick else bench.PoseSettings()
    if frames:
        settings = replace(settings, frames=frames)
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file, plot)


@app.command()
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

    settings = bench.NegativesSettings.quick() if quick else bench.NegativesSettings()
    make_extractor(extractor)  # an unknown one is refused before anything is measured
    settings = replace(settings, data=data, extractor=extractor)
    if frames:
        settings = replace(settings, frames=frames)
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


@app.command()
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
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


@app.command()
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

    settings = bench.GraspSettings.quick() if quick else bench.GraspSettings()
    settings = replace(
        settings,
        static=settings.static if static is None else static,
        handheld=settings.handheld if handheld is None else handheld,
        jobs=settings.jobs if jobs is None else jobs,
    )
    if sides is not None:
        settings = replace(settings, sides=_names(sides, bench.SIDES, "--sides"))
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


@app.command()
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

    settings = bench.LiveSettings.quick() if quick else bench.LiveSettings()
    settings = replace(
        settings,
        repeats=settings.repeats if repeats is None else repeats,
        seconds=settings.seconds if seconds is None else seconds,
    )
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


@app.command()
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

    settings = bench.SoakSettings.quick() if quick else bench.SoakSettings()
    settings = replace(
        settings,
        frames=settings.frames if frames is None else frames,
        losses=settings.losses if losses is None else losses,
    )
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


@app.command()
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

    settings = bench.Ros2Settings.quick() if quick else bench.Ros2Settings()
    settings = replace(
        settings,
        frames=settings.frames if frames is None else frames,
        kills=settings.kills if kills is None else kills,
        program=peer,
    )
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


@app.command()
def estimators(
    *,
    frames: FramesOption = None,
    seed: SeedOption = 0,
    quick: QuickOption = False,
    json_file: JsonFileOption = None,
) -> None:
    """Robust homography estimators of OpenCV, PoseLib and kornia-rs on the same matches."""
    from planegrasp.bench import estimators as bench

    settings = bench.EstimatorsSettings.quick() if quick else bench.EstimatorsSettings()
    if frames:
        settings = replace(settings, frames=frames)
    _measure(lambda advance: bench.run(seed, settings, advance), settings.steps, json_file)


def _measure(run: Run, steps: int, json_file: Path | None, plot: Path | None = None) -> None:
    """Run a benchmark behind a progress bar; print and write what it gives."""
    from planegrasp.cli.bench_tables import print_result
    from planegrasp.cli.progress import frame_progress

    # What would fail at the end fails before anything is measured.
    for path in (json_file, plot):
        if path is not None:
            _make_folder_of(path)
    if plot is not None:
        _require_plots(plot)
    started = time.perf_counter()
    with frame_progress("measuring", steps) as advance:
        result = run(advance)
    out = console()
    print_result(out, result, time.perf_counter() - started)
    if json_file is not None:
        result.write(json_file)
        out.print(f"written: {json_file}", soft_wrap=True)
    if plot is not None:
        from planegrasp.bench.plots import write_plot

        write_plot(result, plot)
        out.print(f"written: {plot}", soft_wrap=True)


def _names(text: str, known: tuple[str, ...], option: str = "--extractors") -> tuple[str, ...]:
    """Names separated by commas, each of them known, without repeats."""
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        raise InvalidInputError(
            f"{option} takes {', '.join(known)}, separated by commas; got {text!r}"
        )
    return names


def _make_folder_of(path: Path) -> None:
    if path.is_dir():
        raise InvalidInputError(f"{path} is a folder: give the file's name")
    path.parent.mkdir(parents=True, exist_ok=True)


def _require_plots(path: Path) -> None:
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise MissingExtraError("--plot", "bench") from error
    if path.suffix.lower() not in (".png", ".svg", ".pdf"):
        raise InvalidInputError(f"--plot draws .png, .svg or .pdf, got {path.name!r}")
