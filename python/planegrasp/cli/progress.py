"""A progress bar that counts frames, or other things."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@contextmanager
def frame_progress(
    what: str, frames: int | None, unit: str = "frames"
) -> Iterator[Callable[[], None]]:
    """A bar on standard error, where that is a terminal, which is gone at the end.

    Args:
        what: is being done.
        frames: how many there are, or None where that is not known.
        unit: what they are called.

    Yields:
        A function to call after every frame.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    messages = Console(stderr=True, highlight=False)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(f"{unit},"),
        TimeElapsedColumn(),
        TextColumn("gone,"),
        TimeRemainingColumn(),
        TextColumn("to go"),
        console=messages,
        disable=not messages.is_terminal,
        transient=True,
    ) as progress:
        task = progress.add_task(what, total=frames)
        yield lambda: progress.advance(task)
