"""The live system on a rendered stream: finds, follows, and spends time by task."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from planegrasp.errors import ImageError, UnknownObjectError
from planegrasp.live import Live, LiveConfig, Task

SYNCHRONOUS = LiveConfig(background=False)


def distance(detection, truth) -> float:
    """Millimetres."""
    return 1e3 * np.linalg.norm(detection.T_camera_object.translation - truth.translation)


def test_all_are_found_in_the_first_frame_and_tracked_in_the_others(three):
    _, detector, frames = three
    with Live(detector, config=SYNCHRONOUS) as live:
        for number, one in enumerate(frames):
            result = live.process(one.frame)
            assert {d.name for d in result.detections} == set(one.truth)
            for found in result.detections:
                assert found.tracked == (number > 0)
                assert distance(found, one.truth[found.name]) < 2.0
            assert len(result.new) == (3 if number == 0 else 0)
            assert result.lost == ()
            assert result.skipped == ()
            assert result.frame is one.frame
            assert result.seconds["track"] >= 0.0


def test_in_the_background_they_are_found_within_some_frames(three):
    _, detector, frames = three
    with Live(detector) as live:
        first = live.process(frames[0].frame)
        assert first.detections == ()
        found = set()
        for one in frames[1:]:
            # As a camera would, which waits for its next frame.
            time.sleep(1 / 30)
            result = live.process(one.frame)
            found |= {d.name for d in result.detections}
            for detection in result.detections:
                assert detection.tracked
                assert distance(detection, one.truth[detection.name]) < 2.0
        assert found == set(frames[0].truth)


def test_the_same_stream_gives_the_same_poses_without_a_thread(three):
    _, detector, frames = three

    def poses():
        with Live(detector, config=SYNCHRONOUS) as live:
            results = [live.process(one.frame) for one in frames[:6]]
        return [d.T_camera_object.as_matrix() for r in results for d in r.detections]

    for a, b in zip(poses(), poses(), strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_task_leaves_the_others_alone_and_counts_from_the_next_frame(three):
    objects, detector, frames = three
    first, second = objects[0].name, objects[1].name
    with Live(detector, Task({first: 1.0}, others=False), SYNCHRONOUS) as live:
        assert {d.name for d in live.process(frames[0].frame).detections} == {first}
        assert {d.name for d in live.process(frames[1].frame).detections} == {first}
        live.task = Task({second: 1.0}, others=False)
        assert {d.name for d in live.process(frames[2].frame).detections} == {first, second}


def test_a_small_budget_goes_to_what_is_wanted_most(three):
    objects, detector, frames = three
    wanted = objects[2].name
    with Live(
        detector, Task({wanted: 5.0, objects[0].name: 1.0}, budget=1e-6), SYNCHRONOUS
    ) as live:
        live.process(frames[0].frame)
        for one in frames[1:5]:
            result = live.process(one.frame)
            assert [d.name for d in result.detections] == [wanted]
            followed = {s.name for s in result.skipped if s.instance is not None}
            assert followed == {model.name for model in objects} - {wanted}
            assert "suffice for 1 objects" in result.skipped[0].reason


def test_equally_wanted_ones_get_their_turn(three):
    objects, detector, frames = three
    with Live(detector, Task(budget=1e-6), SYNCHRONOUS) as live:
        live.process(frames[0].frame)
        followed = [live.process(one.frame).detections[0].name for one in frames[1:7]]
    assert set(followed[:3]) == {model.name for model in objects}
    assert followed[:3] == followed[3:]


def test_what_disappears_is_lost_once(three):
    _, detector, frames = three
    gray = np.full_like(frames[0].frame.color, 128)
    lost = []
    with Live(detector, config=SYNCHRONOUS) as live:
        for number, one in enumerate(frames):
            frame = one.frame if number < 3 else replace(one.frame, color=gray)
            lost += [track.name for track in live.process(frame).lost]
    assert sorted(lost) == sorted(frames[0].truth)


def test_a_task_for_something_unknown_is_refused_and_the_old_one_stays(three):
    objects, detector, _ = three
    task = Task({objects[0].name: 1.0})
    with Live(detector, task, SYNCHRONOUS) as live:
        with pytest.raises(UnknownObjectError, match="the task wants 'unicorn', which was not"):
            live.task = Task({"unicorn": 1.0})
        assert live.task is task


def test_what_has_not_been_there_for_long_is_looked_for_now_and_then(three):
    _, detector, frames = three

    class Blind:
        references = detector.references

        def detect(self, frame, among=None, *, closely=True):
            return []

    config = LiveConfig(background=False, urgent_for=0.19, rest=0.5)
    with Live(Blind(), config=config) as live:
        for number in range(60):
            live.process(replace(frames[0].frame, timestamp=number / 30))
    # In six frames of the first 0.19 s, and then twice a second: at 0.67, 1.17 and 1.67 s.
    assert live.passes == 6 + 3


def test_an_error_of_the_search_is_raised_where_its_result_is_taken(three):
    _, detector, frames = three

    class Broken:
        references = detector.references

        def detect(self, frame, among=None, *, closely=True):
            raise ImageError("a colour image is uint8")

    def play(live):
        for one in frames:
            live.process(one.frame)
            time.sleep(0.05)

    with Live(Broken()) as live, pytest.raises(ImageError, match="uint8"):
        play(live)


def test_closing_twice_is_no_error_and_ends_the_thread(three):
    import threading

    _, detector, frames = three
    before = threading.active_count()
    live = Live(detector)
    live.process(frames[0].frame)
    live.close()
    live.close()
    assert threading.active_count() == before
