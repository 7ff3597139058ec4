"""Options that say which objects matter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.live import Task

TASK_PANEL = "Task"

WantOption = Annotated[
    list[str] | None,
    typer.Option(
        help="An object that matters, the larger the priority (1) the more; may be repeated.",
        metavar="NAME[=PRIORITY]",
        show_default="all, as the library says",
        rich_help_panel=TASK_PANEL,
    ),
]
BudgetOption = Annotated[
    float | None,
    typer.Option(
        help="Time to spend on a frame [ms].", show_default="25", rich_help_panel=TASK_PANEL
    ),
]


def task_of(want: Sequence[str], budget: float | None) -> Task:
    """What the options ask for.

    Raises:
        InvalidInputError: a priority is no number, or the budget none that is possible.
    """
    from planegrasp.live import Task

    priorities = {}
    for text in want:
        name, _, priority = text.partition("=")
        try:
            priorities[name] = float(priority) if "=" in text else 1.0
        except ValueError:
            raise InvalidInputError(
                f"--want takes NAME or NAME=PRIORITY with a number, got {text!r}"
            ) from None
    if budget is None:
        return Task(priorities)
    if not budget > 0:
        raise InvalidInputError(f"--budget must be > 0 ms, got {budget:g}")
    return Task(priorities, budget=budget / 1000)
