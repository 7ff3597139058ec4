"""How threads stand behind others, asked of the operating system and of the interpreter."""

from __future__ import annotations

import gc
import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from planegrasp import _core
from planegrasp.live import prompt
from planegrasp.live.urgency import step_back


def niceness() -> int:
    return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())


def policy_and_nice() -> tuple[int, int]:
    return os.sched_getscheduler(0), niceness()


def in_a_new_thread(*calls):
    with ThreadPoolExecutor(1) as threads:
        return [threads.submit(call).result() for call in calls]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="threads have no niceness")
def test_a_thread_steps_back_alone():
    before = niceness()
    _, (policy, nice) = in_a_new_thread(step_back, policy_and_nice)
    assert policy == os.SCHED_OTHER
    assert nice == max(10, before)
    assert niceness() == before


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="threads have no niceness")
def test_who_is_less_urgent_already_stays_so():
    *_, nice = in_a_new_thread(lambda: os.nice(19), step_back, niceness)
    assert nice == 19


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="threads have no niceness")
def test_it_is_less_urgent_also_where_the_system_knows_no_turns(monkeypatch):
    monkeypatch.setattr("platform.machine", lambda: "another")
    _, nice = in_a_new_thread(step_back, niceness)
    assert nice >= 10


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="threads have no niceness")
def test_all_threads_of_a_pool_step_back():
    stepped = []
    pool = _core.ThreadPool(lambda: stepped.append((step_back(), niceness())))
    assert pool.run(niceness) >= 10
    assert stepped
    assert all(nice >= 10 for _, nice in stepped)


def test_turns_and_garbage_are_as_before_afterwards():
    turn, frozen = sys.getswitchinterval(), gc.get_freeze_count()
    with prompt():
        assert sys.getswitchinterval() < 0.001
        assert gc.get_freeze_count() > frozen
    assert sys.getswitchinterval() == turn
    assert gc.get_freeze_count() == 0
