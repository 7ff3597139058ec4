"""A task in a file, which another program may change while the cameras run."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict, ValidationError

from planegrasp.errors import InvalidInputError
from planegrasp.live.task import Task

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["TaskFile", "read_task", "task_of_values"]

_BUDGET = Task().budget


class _Content(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    others: bool = True
    budget: float | None = None
    priorities: dict[str, float] = {}


def read_task(path: str | Path, default_budget: float = _BUDGET) -> Task:
    """Read a task (TOML): `budget` [s], `others`, and a table `priorities` by object.

    Args:
        path: of the file.
        default_budget: of a frame, where the file says nothing of it [s].

    Raises:
        InvalidInputError: it is not there, is no TOML, or has an unknown key or a wrong value.
    """
    try:
        values = tomllib.loads(Path(path).read_text(encoding="utf-8"))
        return task_of_values(values, default_budget)
    except OSError as error:
        raise InvalidInputError(f"the task {path} cannot be read: {error.strerror}") from error
    except ValueError as error:  # also TOMLDecodeError, UnicodeDecodeError, InvalidInputError
        raise InvalidInputError(f"the task {path}: {error}") from error


def task_of_values(values: object, default_budget: float = _BUDGET) -> Task:
    """The task that the values of a file or a message say.

    Args:
        values: a mapping with `budget` [s], `others`, and a mapping `priorities` by object; each
            may be missing.
        default_budget: see `read_task`.

    Raises:
        InvalidInputError: it is no mapping, or has an unknown key or a wrong value.
    """
    try:
        content = _Content.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(step) for step in first["loc"]) or "it"
        raise InvalidInputError(
            f"{place}: {first['msg'].lower()}, got {first['input']!r}; there are "
            f"budget [s], others (true or false) and the table priorities"
        ) from error
    budget = default_budget if content.budget is None else content.budget
    return Task(content.priorities, content.others, budget)


class TaskFile:
    """Reads a task again whenever its file changed.

    Args:
        path: of the file, see `read_task`.
        known: names of the objects that may be wanted.
        default_budget: see `read_task`.
    """

    def __init__(
        self, path: str | Path, known: Iterable[str], default_budget: float = _BUDGET
    ) -> None:
        self.path = Path(path)
        self._known = tuple(known)
        self._default_budget = default_budget
        self._state: tuple[int, ...] | None = ()

    def changed(self) -> Task | None:
        """The task, where the file is another one than before; None where it is the same.

        Raises:
            InvalidInputError, UnknownObjectError: the file is damaged or not there, or wants what
                was not taught: raised once, then not again until it changes.
        """
        state = self._look()
        if state == self._state:
            return None
        self._state = state
        task = read_task(self.path, self._default_budget)
        task.check(self._known)
        return task

    def _look(self) -> tuple[int, ...] | None:
        try:
            status = self.path.stat()
        except OSError:
            return None
        return status.st_mtime_ns, status.st_size, status.st_ino
