"""A task as it is sent over a topic."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError
from planegrasp.live.task import Task
from planegrasp.live.task_file import task_of_values

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["task_from_json", "task_to_json"]

_BUDGET = Task().budget


def task_from_json(text: str, known: Iterable[str], default_budget: float = _BUDGET) -> Task:
    """Read a task: `priorities` by object, `others`, `budget` [s]; see `Task`.

    Args:
        text: for example ``{"priorities": {"book": 2}, "others": false}``; ``{}`` wants all.
        known: names of the objects that may be wanted.
        default_budget: of a frame, where the text says nothing of it [s].

    Raises:
        InvalidInputError: it is no JSON, or has an unknown key or a wrong value.
        UnknownObjectError: it wants what was not taught.
    """
    try:
        task = task_of_values(json.loads(text), default_budget)
    except ValueError as error:  # also JSONDecodeError, InvalidInputError
        raise InvalidInputError(f"the task {text[:80]!r}: {error}") from error
    task.check(known)
    return task


def task_to_json(task: Task) -> str:
    """The text that `task_from_json` reads."""
    return json.dumps(
        {"priorities": dict(task.priorities), "others": task.others, "budget": task.budget}
    )
