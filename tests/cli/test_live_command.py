"""`planegrasp live`, run as a shell would."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import urllib.request

import numpy as np
import pytest
from rendered_stream import shots, taught, write_video
from rerun_server import free_port, rerun_server
from rrd import rows, unfinished_rows

from planegrasp.io.recording import open_recorder
from planegrasp.io.sources import open_source
from planegrasp.library import ObjectLibrary

pytest.importorskip("mcap")
pytest.importorskip("rosbags")

_MAIN = "from planegrasp.cli import main; main()"
NAME = taught()[0].name


def write_library(folder, objects):
    library = ObjectLibrary(folder)
    for model in taught(objects):
        library.add(model)
    library.save()


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A library, a recording and a video of one object; the library's features are learned."""
    folder = tmp_path_factory.mktemp("live")
    write_library(folder / "objects", 1)
    frames = [shot.frame for shot in shots()]
    with open_recorder(folder / "run") as recorder:
        for one in frames:
            recorder.write(one)
    write_video(folder / "video.avi", frames)
    return folder


@pytest.fixture
def here(data, tmp_path):
    for entry in data.iterdir():
        (tmp_path / entry.name).symlink_to(entry)
    return tmp_path


@pytest.fixture
def start(here):
    """Start a live run in a process of its own."""

    begun = []

    def begin(*arguments):
        process = subprocess.Popen(
            [sys.executable, "-c", _MAIN, "live", *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=here,
        )
        begun.append(process)
        return process

    yield begin
    for process in begun:
        with process:
            process.kill()


def wait_for(process, text):
    """Read standard error until a line has a text; returns the line."""
    while text not in (line := process.stderr.readline()):
        assert line, f"ended without {text!r}"
    return line


def lines_of(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def kinds(result):
    return [event["kind"] for event in result["events"]]


@pytest.mark.usefixtures("here")
def test_every_frame_of_a_recording(run, here):
    pytest.importorskip("rerun.chunk", reason="needs rerun-sdk with its reader")
    code, out, err = run(
        *("live", "run", "--no-pace", "--json", "--rrd", "a.rrd", "--image-rate", 15),
        *("--record", "out/a.jsonl", "--record-frames", "a.mcap"),
    )
    assert code == 0, err
    result = json.loads(out)
    assert (result["frames"], result["read"], result["dropped"]) == (24, 24, 0)
    assert (result["stopped"], result["recorded"]) == ("end of the source", True)
    assert result["objects"] == {NAME: {"frames": 24, "found": 1, "lost": 0}}
    assert kinds(result) == ["found", "camera ended"]
    assert f"found: {NAME} at 0.8" in err
    seen = lines_of(here / "out" / "a.jsonl")
    assert [row["frame"] for row in seen] == [shot.frame.name for shot in shots()]
    assert [row["detections"][0]["tracked"] for row in seen] == [False] + [True] * 23
    assert [row["new"] for row in seen] == [[0]] + [[]] * 23
    for row, shot in zip(seen, shots(), strict=True):
        (track,) = row["tracks"]
        error = np.subtract(track["translation"], shot.truth[NAME].translation)
        assert np.linalg.norm(error) < 0.005
        assert (track["name"], track["seen"], track["reason"]) == (NAME, True, "")
    frames = list(open_source("a.mcap"))
    assert len(frames) == 24
    np.testing.assert_array_equal(frames[7].color, shots()[7].frame.color)
    places = rows(here / "a.rrd", f"/world/objects/{NAME}/0", "Transform3D:translation")
    assert len(places) == 24
    images = rows(here / "a.rrd", "/world/camera/color", "EncodedImage:blob")
    assert [number for number, _ in images] == list(range(0, 24, 2))
    notes = rows(here / "a.rrd", "/events", "TextLog:text")
    assert [text.partition(":")[0] for _, (text,) in notes] == ["found", "camera ended"]


@pytest.mark.usefixtures("here")
def test_limits(run):
    code, out, _ = run("live", "run", "--no-pace", "--frames", 3)
    assert code == 0
    assert out.splitlines() == [
        "3 frames in 0.1 s, 0 dropped; ended by frames",
        f"{NAME}: seen in 3 frames, found 1×, lost 0×",
    ]
    code, out, _ = run("live", "run", "--no-pace", "--seconds", 0.19, "--json")
    assert (code, json.loads(out)["stopped"], json.loads(out)["frames"]) == (0, "seconds", 7)


def test_time_is_spent_on_what_is_wanted(run, tmp_path):
    write_library(tmp_path / "objects", 3)
    with open_recorder(tmp_path / "run") as recorder:
        for shot in shots(3, 4):
            recorder.write(shot.frame)
    names = [model.name for model in taught(3)]
    options = ("live", "run", "--no-pace", "--record")
    assert run(*options, "all.jsonl", "--budget", 10_000)[0] == 0
    last = lines_of(tmp_path / "all.jsonl")[-1]
    assert {track["name"] for track in last["tracks"] if track["seen"]} == set(names)
    assert last["skipped"] == []
    wanted = names[1]
    assert run(*options, "one.jsonl", "--want", f"{wanted}=5", "--budget", 0.001)[0] == 0
    *_, last = lines_of(tmp_path / "one.jsonl")
    tracks = {track["name"]: track["seen"] for track in last["tracks"]}
    assert tracks[wanted]
    assert {one["name"] for one in last["skipped"]} == set(names) - {wanted}


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--want", "nobody"], "the task wants 'nobody', which was not taught"),
        (["--want", f"{NAME}=high"], f"NAME=PRIORITY with a number, got '{NAME}=high'"),
        (["--budget", "0"], "--budget must be > 0 ms, got 0"),
        (["--task-file", "none.toml"], "the task none.toml cannot be read: No such file"),
        (["--task-file", "none.toml", "--want", "a"], "--want and --task-file exclude each other"),
        (["--rrd", "a.rrd", "--web"], "--view, --web and --rrd exclude each other"),
        (["--record", "video.avi"], "video.avi exists already: give a new name"),
        (["--rrd", "video.avi"], "video.avi exists already: give a new name"),
        (["--record-frames", "a.zip"], "a.zip names no kind of recording"),
        (["--library", "empty"], "no library empty: teach an object first"),
    ],
)
def test_what_cannot_be_done(run, options, message):
    code, out, err = run("live", "run", "--no-pace", *options)
    assert (code, out) == (1, "")
    assert message in " ".join(err.split())


@pytest.mark.usefixtures("here")
def test_no_camera_leaves_no_files(run, here):
    files = ("--rrd", "a.rrd", "--record", "a.jsonl", "--record-frames", "a.mcap")
    code, _, err = run("live", "opencv:97", *files)
    assert (code, "opencv:97 cannot be opened" in err) == (1, True)
    assert not list(here.glob("a.*"))


@pytest.mark.usefixtures("here")
def test_a_camera_vanishes_and_comes_back(run):
    """OpenCV opens a video like a camera; at its end it is lost, found again and goes on."""
    code, out, err = run("live", "opencv:video.avi", "--fov", 62.7, "--frames", 40, "--json")
    assert code == 0
    result = json.loads(out)
    assert result["losses"] >= 1
    camera = [kind for kind in kinds(result) if kind.startswith("camera")]
    assert camera[:2] == ["camera lost", "camera found"]
    assert "camera lost: opencv:video.avi" in err
    assert result["objects"][NAME]["found"] >= 1


def test_a_signal_the_web_and_a_task_that_changes(start, here):
    port, page = free_port(), free_port()
    (here / "task.toml").write_text("budget = 0.02\n")
    process = start(
        *("opencv:video.avi", "--task-file", "task.toml", "--json", "--no-browser"),
        *("--web", "--port", port, "--web-port", page, "--record", "a.jsonl"),
        *("--record-frames", "a.mcap"),
    )
    wait_for(process, f"the viewer is at http://127.0.0.1:{page}/?url=rerun")
    wait_for(process, "found:")
    with urllib.request.urlopen(f"http://127.0.0.1:{page}/", timeout=20) as answer:
        assert b"<html" in answer.read()
    replace_file(here / "task.toml", f"budget = 0.03\n[priorities]\n{NAME} = 2\n")
    assert f"task: {NAME} 2; 30 ms a frame" in wait_for(process, "task:")
    replace_file(here / "task.toml", "budget = many\n")
    assert "the old one stays" in wait_for(process, "task: the task task.toml:")
    replace_file(here / "task.toml", "[priorities]\nnobody = 1\n")
    assert "'nobody', which was not taught" in wait_for(process, "task:")
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, "Traceback" in err) == (0, False), err
    result = json.loads(out)
    assert (result["stopped"], result["recorded"]) == ("signal", True)
    left_out = sum("too fast for" in event["message"] for event in result["events"])
    seen = lines_of(here / "a.jsonl")
    assert 0 < len(seen) <= result["frames"]
    assert left_out or len(seen) == result["frames"]
    source = open_source(here / "a.mcap")
    assert source.notes == ("a.mcap has no depth images",), "and was not cut off"
    assert len(list(source)) > 0


def test_a_killed_run_can_be_read(start, here):
    pytest.importorskip("rerun.chunk", reason="needs rerun-sdk with its reader")
    files = ("--rrd", "a.rrd", "--record", "a.jsonl", "--record-frames", "a.mcap")
    process = start("opencv:video.avi", *files)
    wait_for(process, "found:")
    wait_for(process, "camera lost:")
    wait_for(process, "camera lost:")
    process.kill()
    process.communicate(timeout=60)
    *whole, last = (here / "a.jsonl").read_text().split("\n")
    assert len([json.loads(line) for line in whole]) > 3
    assert last == "" or not last.endswith("}")
    assert len(list(open_source(here / "a.mcap"))) > 3
    assert len(unfinished_rows(here / "a.rrd", "/plots/count/seen", "Scalars:scalars")) > 3


_LIMITED = f"""
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, 3_000_000))
{_MAIN}
"""


def test_a_full_disk(here):
    pytest.importorskip("rerun.chunk", reason="needs rerun-sdk with its reader")
    files = ("--rrd", "a.rrd", "--record", "a.jsonl", "--record-frames", "a.mcap")
    options = ("run", "--no-pace", "--json", "--image-rate", "1000")
    done = subprocess.run(
        [sys.executable, "-c", _LIMITED, "live", *options, *files],
        capture_output=True,
        text=True,
        check=False,
        cwd=here,
        timeout=120,
    )
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    result = json.loads(done.stdout)
    assert (result["frames"], result["recorded"]) == (24, False)
    assert result["objects"][NAME]["frames"] == 24, "tracking went on"
    for name in ("a.rrd", "a.mcap"):
        (told,) = [line for line in done.stderr.splitlines() if f"recording: {name}" in line]
        assert "cannot be written any further: File too large" in told
        assert "tracking goes on without" in told
    assert 0 < len(lines_of(here / "a.jsonl")) <= 24
    assert 0 < len(list(open_source(here / "a.mcap"))) < 24
    columns = {"/world/cloud": "Points3D:positions", "/plots/count/seen": "Scalars:scalars"}
    assert any(unfinished_rows(here / "a.rrd", *column) for column in columns.items())


def test_the_viewer_is_closed(start):
    """Rerun's own server stands for the viewer: it needs no display."""
    pytest.importorskip("rerun")
    port = free_port()
    with rerun_server(port) as viewer:
        process = start("opencv:video.avi", "--view", "--port", port, "--json")
        wait_for(process, "found:")
        viewer.kill()
        told = wait_for(process, "view:")
    assert "takes no data any more" in told
    assert "tracking goes on without the view" in told
    wait_for(process, "camera found:")
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, "Traceback" in err, "view:" in err) == (0, False, False)
    assert json.loads(out)["stopped"] == "signal"


@pytest.mark.usefixtures("here")
def test_a_port_is_taken(run):
    with socket.socket() as other:
        other.bind(("0.0.0.0", 0))
        other.listen()
        number = other.getsockname()[1]
        code, _, err = run("live", "run", "--web", "--port", number, "--no-browser")
    assert (code, f"error: port {number} is taken" in err) == (1, True)


def replace_file(path, text):
    path.with_suffix(".new").write_text(text)
    path.with_suffix(".new").replace(path)
