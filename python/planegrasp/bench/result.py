"""What a benchmark gives: a table to read and a flat map of figures to compare."""

from __future__ import annotations

import json
import os
import platform
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.io.atomic import write_atomically

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    Row = Mapping[str, "str | float | int"]


@dataclass(frozen=True, slots=True)
class BenchResult:
    """The outcome of one benchmark.

    Attributes:
        bench: its name.
        seed: of everything random.
        settings: what it was run with.
        rows: the table, one mapping a row, all with the same columns.
        figures: names to numbers; the names are kept from version to version.
        notes: lines to print below the table.
    """

    bench: str
    seed: int
    settings: Mapping[str, object]
    rows: Sequence[Row]
    figures: Mapping[str, float]
    notes: Sequence[str] = field(default_factory=tuple)

    def to_json(self) -> str:
        """JSON with bench, seed, machine, settings, rows and figures."""
        content = {
            "bench": self.bench,
            "seed": self.seed,
            "machine": machine(),
            "settings": dict(self.settings),
            "rows": [dict(row) for row in self.rows],
            "figures": {name: _number(value) for name, value in self.figures.items()},
        }
        return json.dumps(content, indent=1, ensure_ascii=False)

    def write(self, path: Path) -> None:
        """Write the JSON, atomically; folders are made."""
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, self.to_json().encode())


def machine() -> dict[str, str | int]:
    """The machine that the numbers come from."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line for line in cpuinfo.read_text().splitlines() if line.startswith("model name")]
        if names:
            model = names[0].split(":", 1)[1].strip()
    return {
        "processor": model,
        "architecture": platform.machine(),
        "cores": os.cpu_count() or 1,
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
    }


def _number(value: float) -> float | None:
    """JSON has no NaN and no infinity: a figure without a value is null."""
    return float(value) if np.isfinite(value) else None
