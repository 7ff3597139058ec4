"""`planegrasp record`, run as a shell would."""

from __future__ import annotations

import json
import signal
import subprocess
import sys

import cv2
import numpy as np
import pytest
from recorded_frames import CAMERA, assert_same, frame

from planegrasp.io import write_camera
from planegrasp.io.recording import open_recorder
from planegrasp.io.sources import open_source

pytest.importorskip("mcap")
pytest.importorskip("rosbags")

_MAIN = "from planegrasp.cli import main; main()"


@pytest.fixture
def recording(tmp_path):
    frames = [frame(i, depth=i != 1) for i in range(6)]
    with open_recorder(tmp_path / "run") as recorder:
        for one in frames:
            recorder.write(one)
    return frames


@pytest.fixture
def video(tmp_path):
    path = tmp_path / "video.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (64, 48))
    for i in range(20):
        writer.write(np.full((48, 64, 3), 10 * i, np.uint8))
    writer.release()
    return path


def test_from_one_form_to_the_other_and_back(run, recording):
    code, out, err = run("record", "run", "there.mcap")
    assert (code, err) == (0, "")
    assert out == "6 frames (5 with depth, 0.2 s) in there.mcap\n"
    assert run("record", "there.mcap", "back")[0] == 0
    assert_same(list(open_source("there.mcap")), recording)
    assert_same(list(open_source("back")), recording)


def test_json(run, recording):
    code, out, _ = run("record", "run", "new/two.mcap", "--frames", 2, "--json")
    assert code == 0
    assert json.loads(out) == {
        "source": "run",
        "output": "new/two.mcap",
        "frames": 2,
        "with_depth": 1,
        "seconds": pytest.approx(1 / 30, abs=1e-5),
        "dropped": 0,
        "losses": 0,
        "stopped": "frames",
        "events": [],
    }
    assert_same(list(open_source("new/two.mcap")), recording[:2])


def test_seconds_are_those_of_the_timestamps(run, recording):
    code, out, _ = run("record", "run", "short", "--seconds", 0.09, "--json")
    assert (code, json.loads(out)["stopped"]) == (0, "seconds")
    assert_same(list(open_source("short")), recording[:4])


@pytest.mark.usefixtures("recording")
def test_topics_of_a_ros_recording(run):
    run("record", "run", "a.mcap")
    assert run("record", "a.mcap", "b", "--depth-topic", "")[0] == 0
    assert all(one.depth is None for one in open_source("b"))
    code, _, err = run("record", "a.mcap", "c", "--color-topic", "/none")
    assert (code, "there is no topic '/none' for color" in err) == (1, True)


def test_a_camera(run, video):
    """OpenCV opens a video like a camera; at its end it is lost, found again and goes on."""
    code, out, err = run("record", f"opencv:{video}", "live.mcap", "--frames", 25, "--json")
    assert code == 0
    seen = json.loads(out)
    assert (seen["frames"], seen["with_depth"], seen["stopped"]) == (25, 0, "frames")
    assert seen["losses"] >= 1
    assert [event["kind"] for event in seen["events"][:2]] == ["lost", "found"]
    assert "note: no camera given: assuming a horizontal field of view of 60°" in err
    assert "lost: opencv:" in err
    stamps = [one.timestamp for one in open_source("live.mcap")]
    assert len(stamps) == 25
    assert np.all(np.diff(stamps) > 0)


def test_the_time_of_a_camera_ends(run, video):
    code, out, _ = run("record", f"opencv:{video}", "live", "--seconds", 0.05, "--json")
    assert (code, json.loads(out)["stopped"]) == (0, "seconds")
    assert len(list(open_source("live"))) == json.loads(out)["frames"] > 0


def test_an_error_of_the_camera_ends_it(run, video):
    write_camera("camera.json", CAMERA)
    code, _, err = run("record", f"opencv:{video}", "live", "--camera", "camera.json")
    assert (code, "the camera is for 8×6 images, this image is 64×48" in err) == (1, True)


@pytest.mark.usefixtures("recording")
def test_what_cannot_be_recorded(run):
    code, _, err = run("record", "opencv:97", "new")
    assert (code, "opencv:97 cannot be opened" in err) == (1, True)
    code, _, err = run("record", "nowhere", "new")
    assert (code, "there is no file or folder nowhere" in err) == (1, True)
    code, _, err = run("record", "opencv:0", "new", "--depth-topic", "/depth")
    assert (code, "for recordings, opencv:0 is a camera" in err) == (1, True)
    code, _, err = run("record", "run", "new", "--fps", 30)
    assert (code, "--fps are for cameras, run is none" in err) == (1, True)
    code, _, err = run("record", "run", "run")
    assert (code, "run exists already: give a new name" in err) == (1, True)


@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly(tmp_path, video, kind):
    with subprocess.Popen(
        [sys.executable, "-c", _MAIN, "record", f"opencv:{video}", "live.mcap", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
    ) as process:
        for _ in range(3):  # frames are recorded before it is lost for a second time
            while "lost:" not in (line := process.stderr.readline()):
                assert line, "it has ended"
        process.send_signal(kind)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, "Traceback" in err) == (0, False)
    seen = json.loads(out)
    assert seen["stopped"] == "signal"
    source = open_source(tmp_path / "live.mcap")
    assert source.notes == ("live.mcap has no depth images",), "and was not cut off"
    assert len(list(source)) == seen["frames"] > 0


def test_the_size_of_a_folders_frames_changes(run, tmp_path):
    frames = [frame(0), frame(1), frame(2, size=(12, 10))]
    with open_recorder(tmp_path / "run.mcap") as recorder:
        for one in frames:
            recorder.write(one)
    code, _, err = run("record", "run.mcap", "folder")
    assert (code, "record to NAME.mcap" in err) == (1, True)
    assert_same(list(open_source("folder")), frames[:2])
    assert open_source("folder").notes == ()
