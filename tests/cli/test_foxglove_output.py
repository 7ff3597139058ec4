"""A live run's output for Foxglove when its file comes to an end before the run does."""

from __future__ import annotations

import threading

import pytest

pytest.importorskip("foxglove")

from planegrasp.cli.foxglove_output import FoxgloveOutput
from planegrasp.errors import RecordingError


class Stream:
    """Logs a frame when it is let go; the file fails at the second one, and the server stays."""

    class log:  # noqa: N801
        path = "run.mcap"

    server = True

    def __init__(self):
        self.frames = []
        self.begun = threading.Semaphore(0)
        self.let_go = threading.Semaphore(0)

    def live(self, seen, header):
        self.begun.release()
        assert self.let_go.acquire(timeout=10)
        self.frames.append(seen.frame)
        if len(self.frames) == 2:
            self.log = None
            raise RecordingError("the disk is full")

    def close(self):
        self.is_closed = True


class Seen:
    def __init__(self, frame):
        self.frame = frame


def test_only_the_newest_frame_waits_once_there_is_no_file():
    stream = Stream()
    output = FoxgloveOutput(stream, wait=False)
    output.frame(Seen(0), None)
    assert stream.begun.acquire(timeout=10)
    for i in range(1, 33):
        output.frame(Seen(i), None)
    assert output.left_out == 2, "of a file all are missed"
    stream.let_go.release(2)
    for _ in range(2):
        assert stream.begun.acquire(timeout=10)
    assert str(output.take_error()) == "the disk is full"
    for i in range(100, 110):
        output.frame(Seen(i), None)
    stream.let_go.release(100)
    output.close()
    assert stream.frames == [0, 3, 4, 109]
    assert output.left_out == 2, "of what is only shown nothing is missed"
    assert stream.is_closed
