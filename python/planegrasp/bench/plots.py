"""Benchmarks as pictures: recall and ε by tilt, time by number of objects, pose error by tilt."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.bench import paper
from planegrasp.errors import InvalidInputError, MissingExtraError
from planegrasp.io.atomic import write_atomically

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from planegrasp.bench.result import BenchResult

# Colours that colour-blind readers can tell apart (Okabe & Ito); grey is the paper's.
_COLORS = {
    "sift": "#0072b2",
    "sift_plain": "#56b4e9",
    "akaze": "#e69f00",
    "brisk": "#d55e00",
    "orb": "#009e73",
    "surf": "#cc79a7",
    "surf_plain": "#e5bcd3",
    "fused": "#0072b2",
    "marker": "#111111",
    "pnp": "#e69f00",
    "three_point": "#d55e00",
}
_NAMES = {
    "sift": "SIFT, oblique views",
    "sift_plain": "SIFT",
    "akaze": "AKAZE",
    "brisk": "FAST + BRISK",
    "orb": "ORB",
    "surf": "SURF, oblique views",
    "surf_plain": "SURF",
    "fused": "fused (default)",
    "marker": "AprilTag 36h11",
    "pnp": "pnp (no depth)",
    "three_point": "three_point (paper)",
}
_PAPER_COLOR = "#999999"
_STYLE: dict[Any, Any] = {
    "font.size": 10,
    "font.family": "sans-serif",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlelocation": "left",
    "axes.titlesize": 11,
    "axes.titlepad": 10,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.8,
    "lines.linewidth": 2.0,
    "lines.markersize": 4.5,
    "legend.frameon": False,
    "svg.fonttype": "none",
}
_DPI = 150
_PAPER_MARK = "paper"
_MARK: dict[str, Any] = {
    "marker": "v",
    "color": "none",
    "markeredgecolor": "black",
    "markersize": 9,
}


def write_plot(result: BenchResult, path: Path) -> None:
    """Draw a benchmark's result, atomically; the format is that of the file's name.

    Raises:
        InvalidInputError: there is no picture of this benchmark.
        MissingExtraError: matplotlib is not installed.
    """
    if result.bench not in _PLOTS:
        raise InvalidInputError(
            f"there is no picture of bench {result.bench}; there is one of {', '.join(_PLOTS)}"
        )
    try:
        import matplotlib as mpl
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtraError("a picture of a benchmark", "bench") from error
    content = io.BytesIO()
    with mpl.rc_context(_STYLE):
        figure = Figure(layout="constrained")
        FigureCanvasAgg(figure)
        _PLOTS[result.bench](result, figure)
        kind = path.suffix.lstrip(".").lower() or "png"
        figure.savefig(content, format=kind, dpi=_DPI, facecolor="white")
    write_atomically(path, content.getvalue())


def _tilt(result: BenchResult, figure: Figure) -> None:
    """Recall on the left with the paper's largest angles, ε on the right."""
    figure.set_size_inches(10.5, 4.4)
    recall, epsilon = figure.subplots(1, 2)
    rows = [row for row in result.rows if row["photographs"] == "well-textured"]
    tilts = [int(column.rstrip("°")) for column in rows[0] if column.rstrip("°").isdigit()]
    for rank, row in enumerate(rows):
        extractor = str(row["extractor"])
        front = 3 + len(rows) - rank  # the default, which is first, covers the others
        color, label = _COLORS.get(extractor), _NAMES.get(extractor, extractor)
        shares = [100.0 * float(row[f"{tilt}°"]) for tilt in tilts]
        recall.plot(tilts, shares, "o-", color=color, label=label, clip_on=False, zorder=front)
        values = [result.figures.get(f"{extractor}.epsilon_{tilt}", np.nan) for tilt in tilts]
        epsilon.plot(tilts, values, "o-", color=color, label=label, zorder=front)
        if extractor in paper.MAX_TILT_DEG and extractor != "sift":
            _paper_angle(recall, extractor, color)
    if any(row["extractor"] in ("sift", "sift_plain") for row in rows):
        _paper_angle(recall, "sift", _COLORS["sift_plain"])
    recall.axhline(95, color="#bbbbbb", linewidth=1, zorder=1)
    recall.text(0, 93.6, "95 %", color="#888888", fontsize=8.5, va="top")
    recall.set(
        title="Recall, well-textured photographs",
        xlabel="out-of-plane rotation [°]",
        ylabel="recall [%]",
        xlim=(-1, max(tilts) + 1),
        ylim=(0, 103),
    )
    epsilon.set(
        title="Error ε of the homography (eq. 13 of the paper)",
        xlabel="out-of-plane rotation [°]",
        ylabel="mean ε over successes",
        xlim=(-1, max(tilts) + 1),
        yscale="log",
    )
    handles, labels = recall.get_legend_handles_labels()
    if any(line.get_gid() == _PAPER_MARK for line in recall.get_lines()):
        from matplotlib.lines import Line2D

        handles.append(Line2D([], [], **_MARK))
        labels.append("largest angle in the paper")
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))


def _paper_angle(axes: Axes, extractor: str, color: str | None) -> None:
    """A mark on the 95 % line at the largest angle that the paper gives."""
    angle = paper.MAX_TILT_DEG[extractor]
    axes.plot(angle, 95, markerfacecolor=color, zorder=20, gid=_PAPER_MARK, **_MARK)


def _objects(result: BenchResult, figure: Figure) -> None:
    """Time for n objects over that for one, beside the paper's."""
    figure.set_size_inches(6.6, 4.2)
    axes = figure.subplots()
    numbers = [int(row["objects"]) for row in result.rows]
    ratios = [float(row["over one object"]) for row in result.rows]
    few = [i for i, n in enumerate(numbers) if n <= len(paper.SECONDS_BY_OBJECTS["sift"])]
    _labelled(
        axes,
        [numbers[i] for i in few],
        [ratios[i] for i in few],
        "planegrasp, SIFT",
        _COLORS["sift"],
    )
    for name, times in paper.SECONDS_BY_OBJECTS.items():
        ours = list(range(1, len(times) + 1))
        shift = -7 if name == "sift" else 7
        _labelled(
            axes,
            ours,
            [seconds / times[0] for seconds in times],
            f"paper, {name.upper()}",
            _PAPER_COLOR,
            dashes=name == "surf",
            shift=shift,
        )
    larger = [f"{numbers[i]}: {ratios[i]:.1f} ×" for i in range(len(numbers)) if i not in few]
    if larger:
        note = "objects in the library, six of them in view:\n" + "   ".join(larger)
        axes.text(0.03, 0.96, note, transform=axes.transAxes, va="top", color="#555555")
    axes.set(
        title="Time to detect, over that for one object",
        xlabel="objects taught and in view",
        ylabel="time over one object",
        xlim=(0.9, 7.6),
        ylim=(0, None),
        xticks=range(1, 7),
    )


def _labelled(
    axes: Axes,
    x: Sequence[float],
    y: Sequence[float],
    label: str,
    color: str,
    *,
    dashes: bool = False,
    shift: float = 0.0,
) -> None:
    """A line with its name at its right end."""
    axes.plot(x, y, "o--" if dashes else "o-", color=color)
    axes.annotate(
        label, (x[-1], y[-1]), (8, shift), textcoords="offset points", color=color, va="center"
    )


def _pose(result: BenchResult, figure: Figure) -> None:
    """Median errors by tilt for each method, in the open and partly hidden."""
    from planegrasp.bench.pose import DISTANCE

    figure.set_size_inches(10.5, 4.4)
    panels = figure.subplots(1, 2)
    rows = [row for row in result.rows if row["distance m"] == DISTANCE]
    methods = list(dict.fromkeys(str(row["method"]) for row in rows))
    for axes, column, what in (
        (panels[0], "rotation °", "Rotation error, median [°]"),
        (panels[1], "translation mm", "Translation error, median [mm]"),
    ):
        for method in methods:
            for hidden in ("", "40 %"):
                if hidden and method != "fused":
                    continue
                of_method = [
                    row for row in rows if row["method"] == method and row["hidden"] == hidden
                ]
                axes.plot(
                    [float(row["tilt °"]) for row in of_method],
                    [float(row[column]) for row in of_method],
                    "o:" if hidden else "o-",
                    color=_COLORS.get(method),
                    label=_NAMES.get(method, method) + (", 40 % hidden" if hidden else ""),
                )
        axes.set(title=what, xlabel="out-of-plane rotation [°]", yscale="log")
        axes.yaxis.set_major_formatter(_plain_number)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))


def _plain_number(value: float, _position: int) -> str:
    return f"{value:g}"


_PLOTS: dict[str, Callable[[BenchResult, Figure], None]] = {
    "tilt": _tilt,
    "objects": _objects,
    "pose": _pose,
}
