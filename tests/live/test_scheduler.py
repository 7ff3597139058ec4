"""Who gets the time of a frame."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.live import Task
from planegrasp.live.scheduler import Scheduler


@dataclass
class Named:
    """An object of the library, as far as the scheduler looks at it."""

    name: str
    priority: int = 0


@dataclass
class Followed:
    """A track, likewise."""

    number: int
    name: str
    instance: int = 0
    missing_since: float | None = None


LIBRARY = [Named("book"), Named("box", 2), Named("panel"), Named("label")]


def followed(*names):
    return [Followed(number, name) for number, name in enumerate(names)]


def test_without_a_task_the_library_s_priorities_count():
    assert Scheduler(LIBRARY).wanted(Task()) == ["box", "book", "panel", "label"]


def test_cost_is_learnt_and_the_budget_kept():
    scheduler, tracks = Scheduler(LIBRARY), followed("book", "box", "panel", "label")
    for _ in range(100):
        scheduler.followed(4, 4 * 0.005)
    chosen, skipped = scheduler.to_follow(tracks, Task(budget=0.0125))
    assert len(chosen) == 2
    assert 1 in chosen, "the box matters most"
    assert [s.reason for s in skipped] == ["the frame's 12 ms suffice for 2 objects"] * 2
    assert len(scheduler.to_follow(tracks, Task(budget=1.0))[0]) == 4


def test_what_is_missed_is_looked_for_often_rather_than_closely():
    scheduler, closely = Scheduler(LIBRARY), []
    for _ in range(9):
        closely.append(scheduler.looks_closely(is_urgent=True))
        scheduler.sought(["book"], closely=closely[-1])
    assert closely == [True, False, False, False, True, False, False, False, True]
    assert scheduler.looks_closely(is_urgent=False), "there is time where nothing is missed"


def test_what_is_missing_is_looked_for_first_and_the_rest_in_turn():
    scheduler = Scheduler(LIBRARY, at_once=1)
    task = Task({"panel": 1.0})
    looked = []
    for _ in range(3):
        looked.append(scheduler.to_find(followed("box"), task)[0])
        scheduler.sought(looked[-1], closely=True)
    assert [names[0] for names in looked] == ["panel"] * 3
    assert {names[1] for names in looked} == {"book", "box", "label"}
    now, skipped = scheduler.to_find(followed("box"), task)
    assert {s.name for s in skipped} == {"book", "label"} - set(now)
    assert all(s.reason == "not its turn to be looked for" for s in skipped)


def test_the_same_until_it_was_looked_for():
    scheduler = Scheduler(LIBRARY, at_once=1)
    first, *others = (scheduler.to_find([], Task({"panel": 1.0}))[0] for _ in range(3))
    assert others == [first, first]


def test_what_is_tracked_waits_while_something_wanted_is_missing():
    scheduler, tracks = Scheduler(LIBRARY), followed("box", "book", "label")
    names, skipped = scheduler.to_find(tracks, Task())
    assert names[0] == "panel"
    assert len(names) == 2, "another one, which is known"
    assert skipped == []
    # Each of those has its turn.
    looked_for = set()
    for _ in range(3):
        names = scheduler.to_find(tracks, Task())[0]
        scheduler.sought(names, closely=True)
        looked_for |= {*names}
    assert looked_for == {model.name for model in LIBRARY}
    all_seen = followed("box", "book", "label", "panel")
    assert len(scheduler.to_find(all_seen, Task())[0]) == 4


def test_only_what_is_wanted_where_others_do_not_matter():
    names, skipped = Scheduler(LIBRARY).to_find([], Task({"box": 1, "book": 3}, others=False))
    assert names == ["book", "box"]
    assert skipped == []
    # Tracked already, it is still looked for: there may be another one.
    assert Scheduler(LIBRARY).to_find(followed("box"), Task({"box": 1}, others=False))[0] == ["box"]


def test_what_is_not_seen_where_it_should_be_is_looked_for():
    scheduler, task = Scheduler(LIBRARY, at_once=1), Task({"box": 1.0})
    hidden = [Followed(0, "box", missing_since=1.0)]
    assert scheduler.is_urgent(hidden, task, 1.0)
    assert scheduler.to_find(hidden, task)[0][0] == "box"


def test_whether_something_wanted_is_missing():
    scheduler = Scheduler(LIBRARY)
    assert scheduler.is_urgent(followed("box"), Task(), 0.0)
    assert not scheduler.is_urgent(followed("box"), Task({"box": 1}), 0.0)


def test_what_is_not_there_for_long_is_urgent_no_more():
    scheduler, task = Scheduler(LIBRARY, urgent_for=10.0), Task({"box": 1})

    def is_urgent(time, *seen):
        tracks = followed(*seen)
        scheduler.saw(tracks, task, time)
        answers = {scheduler.is_urgent(tracks, task, time) for _ in range(2)}
        assert len(answers) == 1, "a question changes nothing"
        return answers.pop()

    assert [is_urgent(time) for time in (5.0, 14.9, 15.1)] == [True, True, False]
    assert not is_urgent(20.0, "box")
    assert [is_urgent(time) for time in (20.1, 29.9, 30.1)] == [True, True, False]
    # A clock that went back, and another task, begin anew.
    assert is_urgent(3.0)
    assert not is_urgent(14.0)
    task = Task({"box": 2, "book": 1})
    assert [is_urgent(time) for time in (14.1, 24.0, 24.2)] == [True, True, False]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"budget": 0.0}, "budget of a frame must be > 0 s, got 0"),
        ({"priorities": {"box": float("nan")}}, "priority of 'box' must be finite, got nan"),
    ],
)
def test_tasks_without_meaning_are_refused(settings, message):
    with pytest.raises(InvalidInputError, match=message):
        Task(**settings)
