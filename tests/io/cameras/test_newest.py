"""Newest frame wins, losses are survived, changes are reported once, the end is clean."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from scripted_camera import ScriptedCamera, frame

from planegrasp.errors import CameraError, CameraLostError, InvalidInputError, SourceError
from planegrasp.io.cameras import EventKind, NewestFrame, StreamConfig, StreamStatus
from planegrasp.io.sources import ImageSequence

QUICK = StreamConfig(first_retry=0.01, longest_retry=0.02)
END = CameraError("the script is over")
GONE = CameraLostError("scripted gives no frames any more")


class Recording(ImageSequence):
    """Frames in memory as a source."""

    def __init__(self, frames):
        super().__init__("recording", ())
        self._frames = frames
        self.ended = False

    def __iter__(self):
        try:
            yield from self._frames
        finally:
            self.ended = True


def kinds(live):
    return [event.kind for event in live.take_events()]


def played(*frames):
    """All frames as a consumer gets them who misses none, and the events."""
    with NewestFrame(Recording(frames), StreamConfig(pace=False)) as live:
        return list(live), live.take_events()


def test_newest_frame_wins(until):
    camera = ScriptedCamera(*(frame(i, float(i)) for i in range(5)))
    with NewestFrame(camera, QUICK) as live:
        until(lambda: live.read == 5)
        assert live.next().name == "4", "the four before it were dropped, not queued"
        assert (live.read, live.dropped) == (5, 4)
        assert live.next(timeout=0.01) is None
        assert live.status is StreamStatus.RUNNING
        camera.give(frame(5, 5.0), END)
        assert live.next().name == "5"
        assert live.dropped == 4


def test_a_frame_is_handed_out_once():
    with NewestFrame(ScriptedCamera(frame(0, 0.0)), QUICK) as live:
        assert live.next().name == "0"
        assert live.next(timeout=0.01) is None
        live._source.give(END)


def test_a_lost_camera_is_opened_again(until):
    camera = ScriptedCamera(frame(0, 0.0))
    with NewestFrame(camera, QUICK) as live:
        assert live.next().name == "0"
        camera.plugged = False
        camera.give(GONE)
        until(lambda: camera.failed_openings > 3)
        assert live.status is StreamStatus.LOST
        assert (live.losses, kinds(live)) == (1, [EventKind.LOST])
        camera.plugged = True
        camera.give(frame(1, 1.0))
        assert live.next().name == "1"
        assert live.status is StreamStatus.RUNNING
        (found,) = live.take_events()
        assert found.kind is EventKind.FOUND
        assert "scripted gives frames again, after" in found.message
        assert camera.opened == 2
        camera.give(END)


def test_a_camera_that_opens_and_gives_nothing_is_one_loss(until):
    camera = ScriptedCamera(frame(0, 0.0), *[GONE] * 5, frame(1, 1.0))
    with NewestFrame(camera, QUICK) as live:
        until(lambda: live.read == 2)
        assert (live.losses, kinds(live)) == (1, [EventKind.LOST, EventKind.FOUND])
        assert (camera.opened, camera.closed) == (6, 5)
        camera.give(END)


def test_hundred_losses_leave_no_threads_and_no_open_camera(until):
    before = threading.active_count()
    steps = [step for i in range(100) for step in (frame(i, float(i)), GONE)]
    camera = ScriptedCamera(*steps, frame(100, 100.0))
    with NewestFrame(camera, StreamConfig(first_retry=0.001, longest_retry=0.002)) as live:
        until(lambda: live.read == 101)
        assert live.losses == 100
        assert threading.active_count() == before + 1
        camera.give(END)
    assert threading.active_count() == before
    assert camera.opened == camera.closed == 101


def test_no_camera_at_the_start():
    camera = ScriptedCamera(frame(0, 0.0))
    camera.plugged = False
    with pytest.raises(CameraLostError, match="scripted is not there"):
        NewestFrame(camera, QUICK)
    with NewestFrame(camera, StreamConfig(first_retry=0.01, wait_at_start=True)) as live:
        assert live.next(timeout=0.05) is None
        assert live.status is StreamStatus.LOST
        camera.plugged = True
        assert live.next().name == "0"
        camera.give(END)


def test_closing_while_the_camera_is_lost(until):
    camera = ScriptedCamera(frame(0, 0.0))
    live = NewestFrame(camera, StreamConfig(first_retry=3600.0, longest_retry=3600.0))
    assert live.next() is not None
    camera.give(GONE)
    until(lambda: live.status is StreamStatus.LOST)
    live.close()
    assert not live._thread.is_alive(), "the hour's wait for the camera was cut short"
    assert live.status is StreamStatus.ENDED
    assert camera.opened == camera.closed == 1
    live.close()


def test_closing_with_a_driver_that_does_not_return(until):
    camera = ScriptedCamera(timeout=60.0)
    live = NewestFrame(camera, StreamConfig(close_timeout=0.05))
    live.close()
    assert live.next() is None
    assert camera.closed == 0
    camera.give(frame(0, 0.0))
    until(lambda: not live._thread.is_alive())
    assert camera.closed == 1, "released when the driver returned"


def test_closing_wakes_a_waiting_consumer(until):
    camera = ScriptedCamera()
    live = NewestFrame(camera, StreamConfig(close_timeout=0.01))
    got = []
    consumer = threading.Thread(target=lambda: got.append(live.next()))
    consumer.start()
    live.close()
    consumer.join(30.0)
    assert got == [None]
    camera.give(END)
    until(lambda: not live._thread.is_alive())


def test_an_error_of_the_source_reaches_the_consumer():
    with NewestFrame(ScriptedCamera(frame(0, 0.0), END), QUICK) as live:
        with pytest.raises(CameraError, match="the script is over"):
            list(live)
        assert live.status is StreamStatus.ENDED


def test_a_damaged_recording_reaches_the_consumer_after_its_frames():
    def damaged():
        yield frame(0, 0.0)
        raise SourceError("1.png is empty")

    with NewestFrame(Recording(damaged()), StreamConfig(pace=False)) as live:
        assert live.next().name == "0"
        with pytest.raises(SourceError, match=r"1\.png is empty"):
            live.next()


def test_unpaced_recording_waits_for_its_consumer():
    frames, events = played(*(frame(i, i / 30) for i in range(50)))
    assert [f.name for f in frames] == [str(i) for i in range(50)]
    assert [f.timestamp for f in frames] == [i / 30 for i in range(50)]
    assert [e.kind for e in events] == [EventKind.ENDED]


def test_paced_recording_is_played_at_its_own_speed(until):
    import time

    source = Recording([frame(i, 100.0 + 0.1 * i) for i in range(4)])
    started = time.monotonic()
    with NewestFrame(source) as live:
        until(lambda: live.status is StreamStatus.ENDED)
        assert time.monotonic() - started >= 0.3, "not faster than its timestamps"
        assert (live.read, live.dropped) == (4, 3)
        assert live.next().name == "3", "the last frame can be taken after the end"
        assert live.next() is None


def test_a_gap_of_a_recording_is_shortened(until):
    source = Recording([frame(0, 0.0), frame(1, 86400.0)])
    with NewestFrame(source, StreamConfig(longest_pause=0.01)) as live:
        until(lambda: live.read == 2)
        assert live.next().timestamp == 86400.0


def test_closing_in_the_middle_of_a_recording():
    source = Recording([frame(0, 0.0), frame(1, 3600.0)])
    live = NewestFrame(source, StreamConfig(longest_pause=3600.0))
    assert live.next().name == "0"
    live.close()
    assert not live._thread.is_alive()
    assert live.next() is None


def test_frames_without_timestamps_get_some():
    frames, _ = played(*(frame(i) for i in range(3)))
    assert [f.timestamp for f in frames] == [0.0, 1 / 30, 2 / 30]
    frames, _ = played(frame(0), frame(1, float("nan")))
    assert frames[1].timestamp == 1 / 30


def test_timestamps_that_go_back_are_shifted():
    own = [10.0, 10.1, 10.2, 3.0, 3.1, 3.2]
    frames, events = played(*(frame(i, t) for i, t in enumerate(own)))
    np.testing.assert_allclose([f.timestamp for f in frames], [10.0, 10.1, 10.2, 10.3, 10.4, 10.5])
    assert [e.kind for e in events] == [EventKind.CLOCK, EventKind.ENDED]
    assert "went back by 7.2 s" in events[0].message
    assert events[0].frame == 3


def test_a_frame_out_of_order_does_not_shift_those_after_it():
    own = [0.0, 0.1, 0.05, 0.3, 0.4]
    frames, events = played(*(frame(i, t) for i, t in enumerate(own)))
    np.testing.assert_allclose([f.timestamp for f in frames], [0.0, 0.1, 0.2, 0.3, 0.4])
    assert [e.kind for e in events] == [EventKind.CLOCK, EventKind.ENDED]


def test_timestamps_that_stand_still_grow():
    frames, _ = played(*(frame(i, 5.0) for i in range(4)))
    assert np.all(np.diff([f.timestamp for f in frames]) > 0)


def test_a_clock_that_jumps_all_the_time_is_reported_once(until):
    own = [float(i % 2) for i in range(60)]
    with NewestFrame(Recording([frame(i, t) for i, t in enumerate(own)]), QUICK) as live:
        live.close()
    frames, events = played(*(frame(i, t) for i, t in enumerate(own)))
    assert np.all(np.diff([f.timestamp for f in frames]) > 0)
    assert [e.kind for e in events] == [EventKind.CLOCK, EventKind.ENDED]


def test_a_change_of_resolution_is_reported_once_and_passes():
    sizes = [(8, 6)] * 3 + [(16, 12)] * 3
    frames, events = played(*(frame(i, float(i), size) for i, size in enumerate(sizes)))
    assert [f.color.shape[1] for f in frames] == [8, 8, 8, 16, 16, 16]
    assert [e.kind for e in events] == [EventKind.RESOLUTION, EventKind.ENDED]
    assert events[0].message == "images are 16×12 now, before they were 8×6"


def test_depth_that_stops_is_reported_once_and_colour_goes_on():
    with_depth = [True] * 3 + [False] * 30 + [True] * 3
    frames, events = played(*(frame(i, i / 30, depth=d) for i, d in enumerate(with_depth)))
    assert [f.depth is not None for f in frames] == with_depth
    assert [(e.kind, e.frame) for e in events] == [
        (EventKind.DEPTH_LOST, 12),
        (EventKind.DEPTH_FOUND, 33),
        (EventKind.ENDED, 36),
    ]


def test_a_camera_without_depth_does_not_miss_it():
    _, events = played(*(frame(i, i / 30, depth=False) for i in range(30)))
    assert [e.kind for e in events] == [EventKind.ENDED]


def test_single_frames_without_depth_are_not_reported():
    _, events = played(*(frame(i, i / 30, depth=i % 3 != 0) for i in range(60)))
    assert [e.kind for e in events] == [EventKind.ENDED]


def test_config_refuses_what_cannot_be():
    with pytest.raises(InvalidInputError, match="first_retry must be a number > 0, got 0"):
        StreamConfig(first_retry=0.0)
    with pytest.raises(InvalidInputError, match="frames_per_second must be a number > 0, got nan"):
        StreamConfig(frames_per_second=float("nan"))
