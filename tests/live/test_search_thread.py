"""A detector in a thread of its own, with a detector that waits to be let go."""

from __future__ import annotations

import threading
import time

import pytest

from planegrasp.errors import ImageError
from planegrasp.geometry import RigidTransform
from planegrasp.live.search_thread import SearchThread


class Gate:
    """Stands for a detector: is done with a frame when it is told."""

    def __init__(self):
        self.begun = []
        self.closely = []
        self._go = threading.Semaphore(0)

    def detect(self, frame, among, *, closely):
        self.begun.append((frame, *among))
        self.closely.append(closely)
        assert self._go.acquire(timeout=10)
        if frame == "broken":
            raise ImageError("no image")
        return [frame]

    def let_go(self, count=1):
        self._go.release(count)


@pytest.fixture
def gate():
    return Gate()


@pytest.fixture
def search(gate):
    thread = SearchThread(gate)
    yield thread
    gate.let_go(100)
    thread.close()


def offer(search, frame, at, *names):
    search.offer(frame, at, RigidTransform.identity(), names, closely=True)


def until(condition):
    end = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


def results(search, count):
    found = []

    def take():
        result = search.take()
        if result is not None:
            found.append(result)
        return len(found) == count

    until(take)
    return found


def test_it_looks_as_closely_as_it_is_asked_to(gate, search):
    gate.let_go(2)
    offer(search, "first", 1.0, "book")
    results(search, 1)
    search.offer("second", 2.0, RigidTransform.identity(), ["book"], closely=False)
    results(search, 1)
    assert gate.closely == [True, False]


def test_it_goes_on_with_the_newest_frame_before_a_result_is_taken(gate, search):
    offer(search, "first", 1.0, "book")
    until(lambda: gate.begun)
    offer(search, "second", 2.0, "book")
    offer(search, "third", 3.0, "box")
    assert search.is_waiting
    gate.let_go()
    until(lambda: len(gate.begun) == 2)
    assert gate.begun == [("first", "book"), ("third", "box")]
    assert not search.is_waiting
    gate.let_go()
    assert [(f.detections, f.time) for f in results(search, 2)] == [
        (["first"], 1.0),
        (["third"], 3.0),
    ]
    assert search.take() is None


def test_the_oldest_frame_is_that_of_which_nothing_was_told(gate, search):
    assert search.oldest is None
    offer(search, "first", 1.0, "book")
    assert search.oldest == 1.0
    until(lambda: gate.begun)
    offer(search, "second", 2.0, "book")
    gate.let_go()
    until(lambda: len(gate.begun) == 2)
    assert search.oldest == 1.0, "its result was not taken"
    results(search, 1)
    assert search.oldest == 2.0
    gate.let_go()
    results(search, 1)
    assert search.oldest is None


def test_an_error_is_raised_once_and_the_thread_goes_on(gate, search):
    gate.let_go(2)
    offer(search, "broken", 1.0, "book")
    with pytest.raises(ImageError, match="no image"):
        results(search, 1)
    offer(search, "good", 2.0, "book")
    assert results(search, 1)[0].detections == ["good"]
