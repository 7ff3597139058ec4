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
# While something wanted is missing, so many objects that are tracked are looked for in one pass.
_TRACKED_TOO = 1
# While something wanted is missing, so many quick passes follow a close one.
_QUICK = 3


class Scheduler:
    """Decides which tracks are followed in a frame, and what a detector looks for next.

    Args:
        models: all objects that there are.
        at_once: so many objects that are not wanted, or are tracked already, a detector looks for
            in one pass, beside those that are wanted and missing.
        urgent_for: how long something wanted is missed after it was seen last, or after the task
            began [s].
    """

    def __init__(
        self, models: Sequence[ObjectModel], at_once: int = 8, urgent_for: float = 60.0
    ) -> None:
        self._library = {model.name: float(model.priority) for model in models}
        self._at_once = at_once
        self._urgent_for = urgent_for
        self._task: Task | None = None
        self._time = 0.0
        # When each object was seen last, or was first wanted [s].
        self._last: dict[str, float] = {}
        self._seconds = _FIRST_GUESS
        self._next_track = 0
        self._quick = 0
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
        It goes on with `sought`.
        """
        tracked = _seen(tracks)
        wanted = self.wanted(task)
        missing = [name for name in wanted if name not in tracked]
        allowed = self._library if task.others else dict.fromkeys(wanted)
        known = set(missing)
        rest = [name for name in self._turn if name in allowed and name not in known]
        spare = _TRACKED_TOO if missing else len(rest)
        of_tracked = set([name for name in rest if name in tracked][:spare])
        turn = [name for name in rest if name not in tracked or name in of_tracked]
        now = turn[: self._at_once]
        reason = "not its turn to be looked for"
        later = (name for name in rest if name not in now and name not in tracked)
        return [*missing, *now], [Skipped(name, None, reason) for name in later]

    def sought(self, names: Sequence[str], *, closely: bool) -> None:
        """A pass for these was begun: now it is the turn of others."""
        self._quick = _QUICK if closely else max(0, self._quick - 1)
        now = set(names)
        self._turn.sort(key=lambda name: name in now)

    def saw(self, tracks: Sequence[Track], task: Task, time: float) -> None:
        """This is followed in the newest frame: what is wanted and missing is missed from now on.

        Another task, and a clock that went back, begin anew.

        Args:
            tracks: what is followed.
            task: what is wanted.
            time: of the frame [s].
        """
        if task is not self._task or time < self._time:
            self._last.clear()
        self._task, self._time = task, time
        self._last.update(dict.fromkeys(_seen(tracks), time))
        for name in self.wanted(task):
            self._last.setdefault(name, time)

    def is_urgent(self, tracks: Sequence[Track], task: Task, time: float) -> bool:
        """Whether something wanted is not seen, but was not long ago.

        That is: not tracked, or not where its track should be. What has not been there for long
        would keep a detector busy forever, above all where the whole library is wanted.

        Args:
            tracks: what is followed.
            task: what is wanted.
            time: of the newest frame [s], which `saw` was told of.
        """
        seen = _seen(tracks)
        missing = (name for name in self.wanted(task) if name not in seen)
        return any(time - self._last.get(name, time) < self._urgent_for for name in missing)

    def looks_closely(self, *, is_urgent: bool) -> bool:
        """Whether a detector takes its time in its next pass.

        What is missed is looked for often rather than closely: most of what comes back shows in a
        first look, and what is not there takes the longest.
        """
        return not (is_urgent and self._quick)

    def _urgency(self, track: Track, task: Task, rank: dict[str, int]) -> tuple[bool, float]:
        priorities = task.priorities or self._library
        return track.name not in rank, -priorities.get(track.name, 0.0)


def _seen(tracks: Sequence[Track]) -> set[str]:
    """Names of the objects that were not looked for in vain: those may have slipped away."""
    return {track.name for track in tracks if track.missing_since is None}
