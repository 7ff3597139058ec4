"""However a log ends, it is read up to its last complete chunk."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from mcap_contents import chunks
from recorded_frames import assert_same, frame

from planegrasp.errors import RecordingError, SourceError
from planegrasp.io.foxglove import FoxgloveConfig, FoxgloveStream
from planegrasp.io.recording import open_recorder
from planegrasp.io.sources import open_source

FRAMES = 3
NOTE = re.compile(
    r"cut\.mcap was cut off when it was recorded: "
    r"(it ends after (\d\.\d) s at log time (\d+\.\d{9})|it has no whole message), "
    r"and is whole up to byte (\d+) of (\d+)"
)


def write_log(path, frames):
    with FoxgloveStream(config=FoxgloveConfig(cloud_points=0)) as stream:
        stream.log_to(path)
        for one in frames:
            stream.detections(one, [])


def write_recording(path, frames):
    with open_recorder(path) as recorder:
        for one in frames:
            recorder.write(one)


def record_ends(data):
    """Bytes behind each record of the file, which are opcode, length, content."""
    ends, at = [], 8
    while at + 9 <= len(data) - 8:
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        ends.append(at)
    assert ends[-1] == len(data) - 8
    return ends


@pytest.mark.parametrize("write", [write_log, write_recording])
def test_cut_at_any_byte(tmp_path, write):
    frames = [frame(i) for i in range(FRAMES)]
    whole = tmp_path / "whole.mcap"
    write(whole, frames)
    data = whole.read_bytes()
    ends = record_ends(data)
    chunk_ends = [end for _, end in chunks(whole)]
    per_frame = len(chunk_ends) // FRAMES  # three of a recording
    complete = chunk_ends[per_frame - 1 :: per_frame]
    assert len(complete) == FRAMES
    near = {end + i for end in ends for i in (-1, 0, 1)} & set(range(len(data)))
    sizes = sorted(near | set(range(0, len(data), 13)))
    cut = tmp_path / "cut.mcap"
    counts = []
    for size in sizes:
        cut.write_bytes(data[:size])
        expected = sum(end <= size for end in complete)
        try:
            source = open_source(cut)
        except SourceError as error:
            told, count = NOTE.search(str(error)), 0
        else:
            read = list(source)
            (note,) = source.notes
            told, count = NOTE.fullmatch(note), len(read)
            assert_same(read, frames[:count])
        assert count == expected, f"cut at byte {size}"
        assert int(told[4]) == max((end for end in ends if end <= size), default=0)
        assert int(told[5]) == size
        begun = (sum(end <= size for end in chunk_ends) - 1) // per_frame
        if begun >= 0:
            assert told[2] == f"{begun / 30:.1f}"
            assert float(told[3]) == pytest.approx(frames[begun].timestamp, abs=1e-6)
        counts.append(count)
    assert set(counts) == {0, 1, 2, 3}


def test_every_single_byte_of_the_smallest_log(tmp_path):
    write_log(tmp_path / "whole.mcap", [frame(0, size=(2, 2))])
    data = (tmp_path / "whole.mcap").read_bytes()
    ((_, complete),) = chunks(tmp_path / "whole.mcap")
    cut = tmp_path / "cut.mcap"
    # A log with all its channels has a long table of contents, where every byte is alike.
    for size in range(min(len(data), complete + 600)):
        cut.write_bytes(data[:size])
        if size < complete:
            with pytest.raises(SourceError, match=r"no whole message, and is whole up to byte \d+"):
                open_source(cut)
        else:
            source = open_source(cut)
            assert len(list(source)) == 1
            assert NOTE.fullmatch(source.notes[0])[3].startswith("1700000000.25")


_WRITE = """
import sys
{before}
sys.path.insert(0, {here!r})
from recorded_frames import frame
from planegrasp.errors import RecordingError
from planegrasp.io.foxglove import FoxgloveStream
with FoxgloveStream() as stream:
    log = stream.log_to({path!r})
    try:
        for i in range(10000):
            stream.detections(frame(i, size=(64, 48)), [])
            if i == 5:
                print("logging", flush=True)
    except RecordingError as error:
        print(error)
    print(log.frames, stream.log)
    stream.detections(frame(0), [])
"""


# In the process itself: to set it between fork and exec is not safe where there are threads.
_LIMIT = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1_500_000, 1_500_000))"


def writer(path, before=""):
    here = str(Path(__file__).parents[2])
    script = _WRITE.format(here=here, path=str(path), before=before)
    return subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def same_start(path):
    source = open_source(path)
    read = list(source)
    assert_same(read, [frame(i, size=(64, 48)) for i in range(len(read))])
    assert "was cut off when it was recorded" in source.notes[0]
    return len(read)


def test_the_process_is_killed(tmp_path):
    with writer(tmp_path / "run.mcap") as process:
        assert process.stdout.readline() == "logging\n"
        os.kill(process.pid, signal.SIGKILL)
    assert same_start(tmp_path / "run.mcap") >= 6


def test_a_full_disk(tmp_path):
    pytest.importorskip("resource")
    with writer(tmp_path / "run.mcap", _LIMIT) as process:
        out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, ""), "and neither a traceback nor a line of the library"
    *_, told, last = out.splitlines()
    written = same_start(tmp_path / "run.mcap")
    assert written > 6
    assert f"run.mcap cannot be written any further: File too large; the {written} frames" in told
    assert last == f"{written} None", "the log is closed, and the stream goes on without it"


def test_the_end_does_not_fit(tmp_path, monkeypatch):
    stream = FoxgloveStream()
    log = stream.log_to(tmp_path / "run.mcap")
    stream.detections(frame(0), [])
    full = OSError(28, "No space left on device")

    class Full:
        def write(self, data):
            raise full

        def flush(self):
            pass

        def close(self):
            pass

    log._file._file.close()
    monkeypatch.setattr(log._file, "_file", Full())
    with pytest.raises(RecordingError, match=r"the end of .*run\.mcap cannot be written: No space"):
        stream.close()
    source = open_source(tmp_path / "run.mcap")
    assert_same(list(source), [frame(0)])


def test_an_empty_log(tmp_path):
    with FoxgloveStream() as stream:
        stream.log_to(tmp_path / "run.mcap")
    with pytest.raises(SourceError, match="there is no colour image"):
        open_source(tmp_path / "run.mcap")
