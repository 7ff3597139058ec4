"""Spends the time of a frame: on wanted objects first, on the rest in turn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.live.task import Skipped, Task

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.objects import ObjectModel
    from planegrasp.tracking import Track

__all__ = ["Scheduler"]

# What following one object takes, before it was ever measured [s].
_FIRST_GUESS = 0.002
# Weight of the newest measurement in the running mean.
_NEWEST = 0.1


class Scheduler:
    """Decides which tracks are followed in a frame, and what a detector looks for next.

    Args:
        models: all objects that there are.
        at_once: so many objects that are not wanted, or are tracked already, a detector looks for
            in one pass, beside those that are wanted and missing.
    """

    def __init__(self, models: Sequence[ObjectModel], at_once: int = 8) -> None:
        self._library = {model.name: float(model.priority) for model in models}
        self._at_once = at_once
        self._seconds = _FIRST_GUESS
        self._next_track = 0
        self._turn: list[str] = list(self._library)

    def wanted(self, task: Task) -> list[str]:
        """Names of the objects wanted, the most urgent first."""
        priorities = task.priorities or self._library
        return sorted(priorities, key=lambda name: -priorities[name])

    def to_follow(self, tracks: Sequence[Track], task: Task) -> tuple[list[int], list[Skipped]]:
        """Numbers of the tracks that the budget of a frame suffices for, and what is left out.

        Of equally urgent ones each gets its turn.
        """
        affordable = max(1, int(task.budget / self._seconds))
        rank = {name: i for i, name in enumerate(self.wanted(task))}
        by_turn = sorted(tracks, key=lambda track: (track.number < self._next_track, track.number))
        ordered = sorted(by_turn, key=lambda track: self._urgency(track, task, rank))
        chosen, left = ordered[:affordable], ordered[affordable:]
        if left and chosen:
            self._next_track = chosen[-1].number + 1
        reason = f"the frame's {1000 * task.budget:.0f} ms suffice for {affordable} objects"
        return [t.number for t in chosen], [Skipped(t.name, t.instance, reason) for t in left]

    def followed(self, count: int, seconds: float) -> None:
        """Following so many objects took so long [s]."""
        if count:
            self._seconds += _NEWEST * (seconds / count - self._seconds)

    def to_find(self, tracks: Sequence[Track], task: Task) -> tuple[list[str], list[Skipped]]:
        """What a detector looks for next: what is wanted and missing, and some of the rest in turn.

        The rest has its turn so that further instances are found, and what was not wanted before.
        """
        tracked = _seen(tracks)
        wanted = self.wanted(task)
        missing = [name for name in wanted if name not in tracked]
        allowed = self._library if task.others else dict.fromkeys(wanted)
        rest = [name for name in self._turn if name in allowed and name not in missing]
        now, later = rest[: self._at_once], rest[self._at_once :]
        self._turn = [name for name in self._turn if name not in now] + now
        reason = "not its turn to be looked for"
        skipped = [Skipped(name, None, reason) for name in later if name not in tracked]
        return [*missing, *now], skipped

    def is_missing_something(self, tracks: Sequence[Track], task: Task) -> bool:
        """Whether something wanted is not tracked, or not seen where its track should be."""
        seen = _seen(tracks)
        return any(name not in seen for name in self.wanted(task))

    def _urgency(self, track: Track, task: Task, rank: dict[str, int]) -> tuple[bool, float]:
        priorities = task.priorities or self._library
        return track.name not in rank, -priorities.get(track.name, 0.0)


def _seen(tracks: Sequence[Track]) -> set[str]:
    """Names of the objects that were not looked for in vain: those may have slipped away."""
    return {track.name for track in tracks if track.missing_since is None}
