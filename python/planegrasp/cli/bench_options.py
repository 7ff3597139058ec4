"""Options of the benchmarks, and running one behind a progress bar."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Protocol, Self, TypeVar

import typer

from planegrasp.cli.common import console
from planegrasp.errors import InvalidInputError, MissingExtraError

if TYPE_CHECKING:
    from collections.abc import Callable
    from dataclasses import Field
    from typing import Any, ClassVar

    from planegrasp.bench.result import BenchResult

    Run = Callable[[Callable[[], None]], BenchResult]

__all__ = [
    "FramesOption",
    "JsonFileOption",
    "PlotOption",
    "QuickOption",
    "SeedOption",
    "chosen",
    "measure",
    "names",
]


class _Settings(Protocol):
    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    @classmethod
    def quick(cls) -> Self:
        """Under a minute."""
        ...


_S = TypeVar("_S", bound=_Settings)

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


def chosen(settings: type[_S], *, quick: bool, **given: object) -> _S:
    """Settings of a benchmark: its own, or its quick ones, but for what was given (not None)."""
    start = settings.quick() if quick else settings()
    return replace(start, **{name: value for name, value in given.items() if value is not None})


def measure(run: Run, steps: int, json_file: Path | None, plot: Path | None = None) -> None:
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


def names(text: str, known: tuple[str, ...], option: str = "--extractors") -> tuple[str, ...]:
    """Names separated by commas, each of them known, without repeats."""
    found = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    unknown = [name for name in found if name not in known]
    if unknown or not found:
        raise InvalidInputError(
            f"{option} takes {', '.join(known)}, separated by commas; got {text!r}"
        )
    return found


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
