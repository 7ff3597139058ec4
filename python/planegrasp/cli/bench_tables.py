"""What `planegrasp bench` prints: tables that fit a terminal, the figures and the notes."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from rich.console import Console
    from rich.table import Table

    from planegrasp.bench.result import BenchResult, Row

    Value = str | float | int

_TILT = re.compile(r"\d+°")
# Columns whose repeats are left blank from row to row: they say which condition a row belongs to.
_CONDITIONS = {"pose": ("distance m", "tilt °", "hidden")}
# A table for each value of this column.
_GROUPS = {"estimators": "matches of"}
# Shares from 0 to 1 that are read as per cent.
_SHARES = ("recall", "success", "three_point_poses")
# Figures that are the tables again, and are in the JSON only.
_REPEATED = {
    "tilt": re.compile(r"\.(recall_at_\d+|epsilon_(?!45$)\d+)$"),
    "objects": re.compile(r"recall_\d$|time_[1-5]_over_1$"),
    "estimators": re.compile(r".*"),
}


def print_result(out: Console, result: BenchResult, seconds: float) -> None:
    """Print the table, the figures and the notes of a benchmark.

    Args:
        out: where to print.
        result: of the benchmark.
        seconds: that it took.
    """
    by_tilt = any(_TILT.fullmatch(column) for row in result.rows for column in row)
    for title, table in _tilt_tables(result) if by_tilt else _plain_tables(result):
        # A title of the table itself would be folded to the table's width.
        out.print(f"\n[bold]{title}[/]", soft_wrap=True)
        out.print(table)
    figures = _figures_table(result)
    if figures.row_count:
        out.print(figures)
        out.print()
    for note in result.notes:
        out.print(f"[dim]· {note}[/]", soft_wrap=True)
    settings = [f"{k} {_setting(v)}" for k, v in result.settings.items() if v not in ("", 0)]
    run = ", ".join([f"seed {result.seed}", *settings])
    out.print(f"[dim]· {run}; took {seconds:.0f} s[/]", soft_wrap=True)


def _plain_tables(result: BenchResult) -> Iterator[tuple[str, Table]]:
    """The rows as they are, in one table or one a group."""
    group = _GROUPS.get(result.bench)
    if group is None:
        yield f"bench {result.bench}", _plain_table(result.rows, _CONDITIONS.get(result.bench, ()))
        return
    for value in dict.fromkeys(str(row[group]) for row in result.rows):
        rows = [
            {k: v for k, v in r.items() if k != group} for r in result.rows if r[group] == value
        ]
        yield f"bench {result.bench}: {value}", _plain_table(rows, ())


def _plain_table(rows: Sequence[Row], conditions: Sequence[str]) -> Table:
    """The rows, with a rule between conditions, whose values are not repeated."""
    table = _table()
    columns = list(rows[0]) if rows else []
    for column in columns:
        texts = any(isinstance(row[column], str) and row[column] for row in rows)
        table.add_column(_heading(column), justify="left" if texts else "right")
    for number, row in enumerate(rows):
        before = rows[number - 1] if number else None
        after = rows[number + 1] if number + 1 < len(rows) else None
        repeats = _same(row, before, conditions)
        cells = [
            "" if repeats and column in conditions else format_value(column, row[column])
            for column in columns
        ]
        table.add_row(*cells, end_section=bool(conditions) and not _same(row, after, conditions))
    return table


def _tilt_tables(result: BenchResult) -> Iterator[tuple[str, Table]]:
    """One row an extractor, then its recall and ε with one row a tilt: the tilts are too many."""
    columns = list(result.rows[0])
    tilts = [column for column in columns if _TILT.fullmatch(column)]
    groups: dict[str, list[Row]] = {}
    for row in result.rows:
        groups.setdefault(str(row["photographs"]), []).append(row)

    summary = _table()
    for column in columns:
        if column not in tilts:
            left = column in ("extractor", "photographs")
            summary.add_column(_heading(column), justify="left" if left else "right")
    for row in result.rows:
        summary.add_row(*(format_value(c, row[c]) for c in columns if c not in tilts))
    yield f"bench {result.bench}", summary

    for group, rows in groups.items():
        table = _table()
        _add_extractors(table, rows)
        for tilt in tilts:
            table.add_row(tilt, *(format_value(tilt, row[tilt]) for row in rows))
        yield f"recall of {group} photographs by tilt, %", table

    table = _table()
    rows = next(iter(groups.values()))
    _add_extractors(table, rows)
    for tilt in tilts:
        names = [f"{row['extractor']}.epsilon_{tilt.rstrip('°')}" for row in rows]
        cells = [_number(1e3 * result.figures.get(name, math.nan)) for name in names]
        if any(cell != "–" for cell in cells):
            table.add_row(tilt, *cells)
    if table.row_count:
        yield "ε × 1000 of well-textured photographs by tilt, mean over successes", table


def _add_extractors(table: Table, rows: Iterable[Row]) -> None:
    table.add_column("tilt", justify="right")
    for row in rows:
        table.add_column(str(row["extractor"]), justify="right")


def _figures_table(result: BenchResult) -> Table:
    """The figures, one line for all that share what stands before the first dot."""
    from rich.table import Table

    repeated = _REPEATED.get(result.bench)
    lines: dict[str, list[str]] = {}
    for name, value in result.figures.items():
        if repeated is not None and repeated.search(name):
            continue
        group, dot, rest = name.partition(".")
        key, label = (group, rest) if dot else ("", name)
        lines.setdefault(key, []).append(f"{label} [bold]{_number(value)}[/]")
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, style="cyan")
    table.add_column()
    for group, figures in lines.items():
        table.add_row(group or "figures", "  ".join(figures))
    return table


def format_value(column: str, value: Value) -> str:
    """A cell: shares in per cent, whole numbers whole, others with three digits."""
    if isinstance(value, str):
        return value
    if column in _SHARES or _TILT.fullmatch(column):
        return _percent(value)
    return _number(value)


def _heading(column: str) -> str:
    heading = column.replace("_deg_", "_°_").replace("_mm_", "_mm_").replace("_", " ")
    return f"{heading} %" if column in _SHARES else heading


def _percent(value: float) -> str:
    """Per cent with one digit, which 100 and 0 go without: 99.97 must not read as 100."""
    if not math.isfinite(value):
        return "–"
    if value in (0.0, 1.0):
        return f"{100 * value:.0f}"
    return f"{min(max(100 * value, 0.1), 99.9):.1f}"


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "–"
    if isinstance(value, int) or float(value).is_integer():
        return f"{value:.0f}"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{min(digits, 6)}f}"


def _setting(value: object) -> str:
    if isinstance(value, (list, tuple)):
        return "/".join(str(item) for item in value)
    return str(value)


def _same(a: Row, b: Row | None, columns: Sequence[str]) -> bool:
    return bool(columns) and b is not None and all(a[column] == b[column] for column in columns)


def _table() -> Table:
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
