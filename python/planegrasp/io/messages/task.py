"""A task as it is sent over a topic."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict, ValidationError

from planegrasp.errors import InvalidInputError
from planegrasp.live.task import Task

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["task_from_json", "task_to_json"]


class _Content(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    priorities: dict[str, float] = {}
    others: bool = True
    budget: float | None = None


def task_from_json(text: str, known: Iterable[str], budget: float | None = None) -> Task:
    """Read a task: `priorities` by object, `others`, `budget` [s]; see `Task`.

    Args:
        text: for example ``{"priorities": {"book": 2}, "others": false}``; ``{}`` wants all.
        known: names of the objects that may be wanted.
        budget: of a frame, where the text says nothing of it [s]; that of `Task` by default.

    Raises:
        InvalidInputError: it is no JSON, or has an unknown key or a wrong value.
        UnknownObjectError: it wants what was not taught.
    """
    try:
        content = _Content.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(step) for step in first["loc"])
        raise InvalidInputError(
            f"the task{f', {place}' if place else ''}: {first['msg'].lower()}, got "
            f"{str(first['input'])[:80]!r}; it is JSON with priorities by object, others (true or "
            f"false) and budget [s]"
        ) from error
    seconds = content.budget if content.budget is not None else budget
    task = Task(content.priorities, content.others, *([] if seconds is None else [seconds]))
    task.check(known)
    return task


def task_to_json(task: Task) -> str:
    """The text that `task_from_json` reads."""
    return json.dumps(
        {"priorities": dict(task.priorities), "others": task.others, "budget": task.budget}
    )
