"""How threads stand behind others, asked of the operating system and of the interpreter."""

from __future__ import annotations

import gc
import os
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from planegrasp import _core
from planegrasp.features import SIFT
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


def features_of(seed):
    gray = np.random.default_rng(seed).integers(0, 256, (240, 320)).astype(np.uint8)
    return SIFT().extract(gray).descriptors


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="threads have no niceness")
def test_a_thread_and_all_of_its_pool_step_back():
    stepped = []

    def work():
        alone = settled_thread_count()
        pool = _core.ThreadPool(lambda: stepped.append((step_back(), niceness())))
        of_pool = 1 + thread_count() - alone
        end = time.monotonic() + 10.0
        while len(stepped) < of_pool and time.monotonic() < end:
            time.sleep(0.01)
        seen = [features_of(seed) for seed in range(3)]
        del pool
        # The threads are gone, the thread works on.
        return niceness(), of_pool, [*seen, features_of(3)]

    before = settled_thread_count()
    ((nice, of_pool, seen),) = in_a_new_thread(work)
    assert nice >= 10
    assert len(stepped) == of_pool
    assert all(nice >= 10 for _, nice in stepped)
    for seed, descriptors in enumerate(seen):
        np.testing.assert_array_equal(descriptors, features_of(seed))
    end = time.monotonic() + 10.0
    while thread_count() > before and time.monotonic() < end:
        time.sleep(0.01)
    assert thread_count() <= before


def test_a_thread_has_one_pool():
    def work():
        pools = [_core.ThreadPool(lambda: None)]
        with pytest.raises(RuntimeError, match="no threads"):
            pools.append(_core.ThreadPool(lambda: None))

    in_a_new_thread(work)


def thread_count() -> int:
    """Threads of the process, those that Python does not know of, too."""
    return len(list(Path("/proc/self/task").iterdir()))


def settled_thread_count() -> int:
    """The same once threads that end are gone."""
    count, end = thread_count(), time.monotonic() + 10.0
    while time.monotonic() < end:
        time.sleep(0.1)
        last, count = count, thread_count()
        if last == count:
            break
    return count


def test_turns_and_garbage_are_as_before_afterwards():
    turn, frozen = sys.getswitchinterval(), gc.get_freeze_count()
    with prompt():
        assert sys.getswitchinterval() < 0.001
        assert gc.get_freeze_count() > frozen
    assert sys.getswitchinterval() == turn
    assert gc.get_freeze_count() == 0
