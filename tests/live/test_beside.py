"""Work beside the frames never holds them up."""

from __future__ import annotations

import threading

import pytest

from planegrasp.live.beside import Beside


class Worker:
    """Works on an item when it is let go."""

    def __init__(self):
        self.done = []
        self.closed = 0
        self.begun = threading.Semaphore(0)
        self.let_go = threading.Semaphore(0)

    def work(self, item):
        self.begun.release()
        assert self.let_go.acquire(timeout=10)
        if isinstance(item, Exception):
            raise item
        self.done.append(item)

    def close(self):
        self.closed += 1


def test_the_oldest_that_waits_is_left_out():
    worker = Worker()
    with Beside(worker.work, worker.close, waiting=2) as beside:
        beside.put(0)
        assert worker.begun.acquire(timeout=10)
        for item in range(1, 6):
            beside.put(item)
        assert beside.left_out == 3
        worker.let_go.release(3)
    assert worker.done == [0, 4, 5], "and what waits is done at the end"
    assert (worker.closed, beside.hangs, beside.take_error()) == (1, False, None)


def test_waiting_for_room_leaves_nothing_out():
    worker = Worker()
    worker.let_go.release(100)
    with Beside(worker.work, worker.close, wait=True) as beside:
        for item in range(100):
            beside.put(item)
    assert worker.done == list(range(100))
    assert beside.left_out == 0


@pytest.mark.parametrize("wait", [False, True])
def test_after_an_error_items_are_ignored(wait):
    worker, wrong = Worker(), OSError("no room")
    worker.let_go.release(100)
    with Beside(worker.work, worker.close, wait=wait) as beside:
        beside.put(wrong)
        while beside.error is None:
            assert worker.begun.acquire(timeout=10)
        for item in range(10):
            beside.put(item)
        assert beside.take_error() is wrong
        assert beside.take_error() is None, "once"
    assert (worker.done, worker.closed) == ([], 1)


def test_the_end_can_fail_too():
    def fail():
        raise OSError("no room for the end")

    with Beside(lambda item: None, fail) as beside:
        beside.put(1)
    assert str(beside.take_error()) == "no room for the end"


def test_what_hangs_is_left_behind():
    worker = Worker()
    beside = Beside(worker.work, worker.close, close_timeout=0.05)
    beside.put(0)
    beside.close()
    assert beside.hangs
    worker.let_go.release()
