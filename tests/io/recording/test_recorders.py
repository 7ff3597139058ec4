"""What is recorded is read back, whatever ends the recording."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from recorded_frames import CAMERA, HEIGHT, WIDTH, assert_same, frame

from planegrasp.errors import InvalidInputError, RecordingError, SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.recording import open_recorder
from planegrasp.io.sources import open_source

pytest.importorskip("mcap")
pytest.importorskip("rosbags")

KINDS = ["run", "run.mcap"]
both = pytest.mark.parametrize("name", KINDS)


def record(path, frames):
    with open_recorder(path) as recorder:
        for one in frames:
            recorder.write(one)
    return recorder


@both
def test_frames_are_read_back(tmp_path, name):
    frames = [frame(i) for i in range(5)]
    recorder = record(tmp_path / name, frames)
    assert (recorder.frames, recorder.seconds) == (5, pytest.approx(4 / 30))
    source = open_source(tmp_path / name)
    assert (source.name, source.length, source.notes) == (name, 5, ())
    assert_same(list(source), frames)
    assert_same(list(source), frames)


@both
def test_frames_without_depth(tmp_path, name):
    frames = [frame(i, depth=i in (1, 2)) for i in range(4)]
    record(tmp_path / name, frames)
    assert_same(list(open_source(tmp_path / name)), frames)


@both
def test_recording_without_any_depth(tmp_path, name):
    frames = [frame(i, depth=False) for i in range(3)]
    record(tmp_path / name, frames)
    source = open_source(tmp_path / name)
    assert_same(list(source), frames)
    assert source.notes == (("run.mcap has no depth images",) if name == "run.mcap" else ())


@both
def test_depth_finer_than_millimetres(tmp_path, name):
    frames = [frame(i, unit=0.0001) for i in range(2)]
    record(tmp_path / name, frames)
    error = 1e-6 if name.endswith(".mcap") else 0.0001 + 1e-6  # half of the folder's 0.2 mm
    assert_same(list(open_source(tmp_path / name)), frames, error)


def test_depth_that_does_not_fit_a_folder_is_left_out(tmp_path):
    far = frame(0, unit=0.0001)
    far.depth[3, 3] = 20.0
    record(tmp_path / "run", [far])
    (read,) = open_source(tmp_path / "run")
    assert read.depth[3, 3] == 0
    assert np.count_nonzero(read.depth) == np.count_nonzero(far.depth) - 1


def test_depth_that_begins_later_sets_the_folders_unit(tmp_path):
    frames = [frame(0, depth=False), frame(1, unit=0.0002)]
    record(tmp_path / "run", frames)
    assert_same(list(open_source(tmp_path / "run")), frames)


@both
def test_frames_without_timestamps_follow_each_other(tmp_path, name):
    frames = [frame(i, stamp=float("nan")) for i in range(3)]
    record(tmp_path / name, frames)
    stamps = [one.timestamp for one in open_source(tmp_path / name)]
    np.testing.assert_allclose(np.diff(stamps), 1 / 30, atol=1e-5)


def test_an_mcap_file_keeps_each_frames_camera(tmp_path):
    other = PinholeCamera(WIDTH, HEIGHT, 12.0, 12.0, 3.5, 2.5)
    frames = [frame(0), frame(1, size=(12, 10)), frame(2), frame(3, camera=other)]
    record(tmp_path / "run.mcap", frames)
    assert_same(list(open_source(tmp_path / "run.mcap")), frames)


def test_a_folder_has_one_camera(tmp_path):
    with open_recorder(tmp_path / "run") as recorder:
        recorder.write(frame(0))
        with pytest.raises(InvalidInputError, match=r"frame 1 has another one .*NAME\.mcap"):
            recorder.write(frame(1, size=(12, 10)))
        recorder.write(frame(1))
    assert_same(list(open_source(tmp_path / "run")), [frame(0), frame(1)])


@both
def test_nothing_is_overwritten(tmp_path, name):
    record(tmp_path / name, [frame(0)])
    with pytest.raises(RecordingError, match="exists already: give a new name"):
        open_recorder(tmp_path / name)
    assert_same(list(open_source(tmp_path / name)), [frame(0)])


def test_names_of_no_kind_of_recording(tmp_path):
    with pytest.raises(RecordingError, match=r"run\.avi names no kind of recording"):
        open_recorder(tmp_path / "run.avi")
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="cannot be written: Not a directory"):
        open_recorder(tmp_path / "file" / "run")
    with pytest.raises(RecordingError, match="cannot be written: File exists"):
        open_recorder(tmp_path / "file" / "run.mcap")


def test_an_mcap_file_cut_at_any_byte(tmp_path):
    frames = [frame(i) for i in range(3)]
    record(tmp_path / "run.mcap", frames)
    data = (tmp_path / "run.mcap").read_bytes()
    cut = tmp_path / "cut.mcap"
    counts = []
    for size in range(0, len(data), 7):
        cut.write_bytes(data[:size])
        try:
            source = open_source(cut)
        except SourceError:
            counts.append(0)
            continue
        read = list(source)
        assert "was cut off when it was recorded: it ends after 0." in source.notes[0]
        assert len(read) == source.length
        counts.append(len(read))
        if counts[-1] != counts[-2]:
            assert_same(read, frames[: len(read)])
    assert counts == sorted(counts), "never fewer frames of a longer file"
    assert set(counts) == {0, 1, 2, 3}


def test_a_folder_cut_at_any_byte_of_its_list(tmp_path):
    frames = [frame(i) for i in range(3)]
    record(tmp_path / "run", frames)
    listing = tmp_path / "run" / "frames.txt"
    data = listing.read_bytes()
    for size in range(len(data)):
        listing.write_bytes(data[:size])
        source = open_source(tmp_path / "run")
        complete = data[:size].count(b"\n")
        assert_same(list(source), frames[:complete])
        last = f"after {complete - 1:06d}" if complete else "before the first frame"
        assert source.notes == (f"run was cut off when it was recorded: it ends {last}",)


def test_an_image_that_the_list_names_is_missing(tmp_path):
    record(tmp_path / "run", [frame(0)])
    (tmp_path / "run" / "color" / "000000.png").unlink()
    with pytest.raises(SourceError, match=r"000000\.png is missing, which .*frames\.txt lists"):
        open_source(tmp_path / "run")


def test_a_wrong_line_of_the_list(tmp_path):
    record(tmp_path / "run", [frame(0)])
    (tmp_path / "run" / "frames.txt").write_text("000000 1.0\n000001 soon\nend\n")
    with pytest.raises(SourceError, match="line 2: expected `name timestamp`, got '000001 soon'"):
        open_source(tmp_path / "run")


def test_an_mcap_file_that_was_changed_is_damaged(tmp_path):
    record(tmp_path / "run.mcap", [frame(i) for i in range(3)])
    data = bytearray((tmp_path / "run.mcap").read_bytes())
    data[len(data) // 2] ^= 0xFF
    (tmp_path / "run.mcap").write_bytes(data)
    with pytest.raises(SourceError, match=r"run\.mcap is a damaged MCAP file"):
        list(open_source(tmp_path / "run.mcap"))


@both
def test_nothing_was_recorded(tmp_path, name):
    record(tmp_path / name, [])
    with pytest.raises(SourceError):
        open_source(tmp_path / name)


_WRITE = """
import sys
sys.path.insert(0, {here!r})
from recorded_frames import frame
from planegrasp.errors import RecordingError
from planegrasp.io.recording import open_recorder
recorder = open_recorder({path!r})
with recorder:
    try:
        for i in range(10000):
            recorder.write(frame(i, size=(64, 48)))
            if i == 5:
                print("recording", flush=True)
    except RecordingError as error:
        print(error)
        try:
            recorder.write(frame(0, size=(64, 48)))
        except RecordingError as again:
            print(again)
print(recorder.frames)
"""


def writer(path, **options):
    script = _WRITE.format(here=str(Path(__file__).parents[2]), path=str(path))
    return subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def same_start(path, frames=None):
    source = open_source(path)
    read = list(source)
    assert_same(read, [frame(i, size=(64, 48)) for i in range(len(read))])
    assert "was cut off when it was recorded" in source.notes[0]
    assert frames in (None, len(read))
    return len(read)


@both
def test_the_recorder_is_killed(tmp_path, name):
    with writer(tmp_path / name) as process:
        assert process.stdout.readline() == "recording\n"
        process.send_signal(signal.SIGKILL)
    assert same_start(tmp_path / name) >= 6


def test_the_disk_is_full_for_an_mcap_file(tmp_path):
    """A limit on the size of files stands for the disk: the same failure of the same call."""

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))

    with writer(tmp_path / "run.mcap", preexec_fn=limit) as process:
        out, err = process.communicate()
    assert process.returncode == 0, err
    _, failure, again, count = out.splitlines()
    assert "run.mcap cannot be written any further: File too large; the " in failure
    assert f"the {count} frames before" in failure
    assert "could not be written any further, see before" in again
    assert same_start(tmp_path / "run.mcap", int(count)) > 5


@both
def test_the_disk_is_really_full(tmp_path, name):
    small = tmp_path / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", str(small)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("mounting a small disk is not allowed here")
    try:
        with writer(small / name) as process:
            out, err = process.communicate()
        assert process.returncode == 0, err
        _, failure, _, count = out.splitlines()
        assert "cannot be written any further: No space left on device" in failure
        assert same_start(small / name, int(count)) > 5
    finally:
        subprocess.run(["umount", str(small)], check=True)


def test_the_camera_of_an_mcap_file_is_complete(tmp_path):
    record(tmp_path / "run.mcap", [frame(0)])
    (read,) = open_source(tmp_path / "run.mcap")
    assert read.camera == CAMERA
