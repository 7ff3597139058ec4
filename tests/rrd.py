"""What a Rerun recording says, read back by Rerun's own reader."""

from __future__ import annotations

import warnings
from datetime import timedelta
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path


def rows(path: Path, entity: str, column: str) -> list[tuple[float | None, Any]]:
    """(frame number or time [s], value) of one column of one entity, in that order.

    None stands for the number of what does not change, and comes first.
    """
    from rerun.chunk import RrdReader

    found = []
    for chunk in RrdReader(path).stream():
        if chunk.entity_path != entity:
            continue
        batch = chunk.to_record_batch()
        if column not in batch.schema.names:
            continue
        values = batch.column(column).to_pylist()
        numbers = [None] * len(values)
        if not chunk.is_static:
            timeline = next(name for name in ("frame", "time") if name in batch.schema.names)
            numbers = [_number(number) for number in batch.column(timeline).to_pylist()]
        found += list(zip(numbers, values, strict=True))
    return sorted(found, key=lambda row: -1 if row[0] is None else row[0])


def unfinished_rows(path: Path, entity: str, column: str) -> list[tuple[float | None, Any]]:
    """`rows` of a file whose end is missing, which Rerun warns about."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return rows(path, entity, column)


def _number(value: int | timedelta) -> float:
    return value.total_seconds() if isinstance(value, timedelta) else value
