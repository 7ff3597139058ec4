"""Which objects matter now, and how much time a frame may take."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError, UnknownObjectError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

__all__ = ["Skipped", "Task"]


@dataclass(frozen=True, slots=True)
class Task:
    """What the robot is about to do, as far as seeing is concerned.

    Attributes:
        priorities: by name of the objects wanted; the larger, the earlier time is spent on it.
            Empty: all objects, by the priorities that the library gives them.
        others: whether to look for the rest of the library, too, in turn, with the time that the
            wanted ones leave.
        budget: time to spend on a frame [s]: that between frames, less what the rest of the
            system needs.
    """

    priorities: Mapping[str, float] = field(default_factory=dict)
    others: bool = True
    budget: float = 0.025

    def __post_init__(self) -> None:
        for name, priority in self.priorities.items():
            if not math.isfinite(priority):
                raise InvalidInputError(f"the priority of {name!r} must be finite, got {priority}")
        if not (math.isfinite(self.budget) and self.budget > 0):
            raise InvalidInputError(f"the budget of a frame must be > 0 s, got {self.budget}")

    def check(self, known: Iterable[str]) -> None:
        """Refuse objects that the library does not have.

        Raises:
            UnknownObjectError: it names the object and lists those that there are.
        """
        names = sorted(known)
        for name in self.priorities:
            if name not in names:
                raise UnknownObjectError(
                    f"the task wants {name!r}, which was not taught; there are {', '.join(names)}"
                )


@dataclass(frozen=True, slots=True)
class Skipped:
    """Something that a frame had no time for.

    Attributes:
        name: of the object.
        instance: of the track that was not followed, None where the object was not looked for.
        reason: in words.
    """

    name: str
    instance: int | None
    reason: str
