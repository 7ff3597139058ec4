"""`--log` and `--foxglove`, as a shell would use them."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("foxglove")
pytest.importorskip("websockets")

from foxglove_client import FoxgloveClient
from mcap_contents import contents, schemas
from rendered_stream import shots, taught
from rerun_server import free_port

from planegrasp.io.foxglove import FoxgloveTopics
from planegrasp.io.recording import open_recorder
from planegrasp.io.sources import open_source
from planegrasp.library import ObjectLibrary

_MAIN = "from planegrasp.cli import main; main()"
_LIMITED = f"""
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, 3_000_000))
{_MAIN}
"""
# A disk that answers no more after 1 MB, and half a second to wait for it.
_HANGING = f"""
import threading
from planegrasp.io.foxglove import log_file
from planegrasp.live.beside import Beside
write = log_file._Target.write
def hanging(self, data):
    if self._position > 1_000_000:
        threading.Event().wait()
    return write(self, data)
log_file._Target.write = hanging
Beside.__init__.__kwdefaults__["close_timeout"] = 0.5
{_MAIN}
"""
NAME = taught()[0].name
FRAMES = 8
TOPICS = FoxgloveTopics()


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A library and a recording of one object; the library's features are learned."""
    folder = tmp_path_factory.mktemp("foxglove")
    library = ObjectLibrary(folder / "objects")
    for model in taught():
        library.add(model)
    library.save()
    with open_recorder(folder / "run.mcap") as recorder:
        for shot in shots()[:FRAMES]:
            recorder.write(shot.frame)
    return folder


@pytest.fixture
def here(data, tmp_path):
    for entry in data.iterdir():
        (tmp_path / entry.name).symlink_to(entry)
    return tmp_path


def found_in(run, path):
    code, out, err = run("detect", path, "--json")
    assert code == 0, err
    return json.loads(out)["results"]


@pytest.mark.usefixtures("here")
def test_a_log_of_a_live_run_is_a_source_of_every_command(run, here):
    code, out, err = run("live", "run.mcap", "--no-pace", "--json", "--log", "out/log.mcap")
    assert code == 0, err
    result = json.loads(out)
    assert (result["frames"], result["recorded"]) == (FRAMES, True)
    log = here / "out" / "log.mcap"
    found = contents(log)
    assert [len(found[t]) for t in (TOPICS.color, TOPICS.depth, TOPICS.tracks)] == [FRAMES] * 3
    said = [message.message for _, message in found[TOPICS.events]]
    assert said[0] == f"object added: {NAME}"
    assert any(text.startswith(f"found: {NAME} at 0.8") for text in said)
    assert said[-1].startswith("camera ended")
    assert found_in(run, log) == found_in(run, "run.mcap"), "to the last bit"
    code, out, err = run("live", log, "--no-pace", "--json")
    assert code == 0, err
    assert json.loads(out)["objects"] == result["objects"]
    code, _, err = run("record", log, "copy.mcap")
    assert code == 0, err
    for a, b in zip(open_source("copy.mcap"), open_source("run.mcap"), strict=True):
        np.testing.assert_array_equal(a.color, b.color)
        np.testing.assert_array_equal(a.depth, b.depth)
        assert a.camera == b.camera


@pytest.mark.usefixtures("here")
def test_a_log_of_detections(run, here):
    code, _, err = run("detect", "run.mcap", "--log", "log.mcap", "--log-color", "raw")
    assert code == 0, err
    assert schemas(here / "log.mcap")[TOPICS.color] == "foxglove.RawImage"
    found = contents(here / "log.mcap")
    assert [len(m["objects"]) for _, m in found[TOPICS.detections]] == [1] * FRAMES
    assert found_in(run, "log.mcap") == found_in(run, "run.mcap")


@pytest.mark.usefixtures("here")
def test_a_log_that_was_cut_off_says_where_it_ends(run, here):
    assert run("detect", "run.mcap", "--log", "log.mcap")[0] == 0
    data = (here / "log.mcap").read_bytes()
    (here / "cut.mcap").write_bytes(data[: len(data) // 2])
    code, out, err = run("detect", "cut.mcap", "--json")
    assert code == 0
    assert 0 < json.loads(out)["frames"] < FRAMES
    assert "note: cut.mcap was cut off when it was recorded: it ends after 0." in err
    assert f"of {len(data) // 2}" in err
    (here / "stub.mcap").write_bytes(data[:5000])
    code, _, err = run("detect", "stub.mcap")
    assert (code, "of 5000" in err, "there is no colour image" in err) == (1, True, True)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--log", "run.mcap"], "run.mcap exists already: give a new name"),
        (["--log", "run.jsonl"], "run.jsonl names no MCAP file: give NAME.mcap"),
        (["--log", "a.mcap", "--log-color", "gif"], "one of png, jpeg, raw, got 'gif'"),
        (["--log", "run.mcap/a.mcap"], "cannot be written: "),
    ],
)
@pytest.mark.parametrize("command", ["detect", "live"])
def test_logs_that_cannot_be(run, here, command, options, message):
    before = (here / "run.mcap").read_bytes()
    code, out, err = run(command, "run.mcap", *options)
    assert (code, out) == (1, "")
    assert message in " ".join(err.split())
    assert (here / "run.mcap").read_bytes() == before


@pytest.mark.usefixtures("here")
def test_addresses_that_cannot_be(run, here):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = f"127.0.0.1:{other.getsockname()[1]}"
        options = ("live", "run.mcap", "--log", "a.mcap", "--foxglove-address")
        code, _, err = run(*options, taken)
    assert (code, f"cannot be served at {taken} (Address already in use" in err) == (1, True)
    code, _, err = run(*options, "here:there")
    assert (code, "an address is HOST:PORT" in " ".join(err.split())) == (1, True)
    assert not (here / "a.mcap").exists(), "no file is begun"


def test_without_the_extra(here):
    """The library is not installed: the error says what to install."""
    hidden = "import sys; sys.modules['foxglove'] = None\n" + _MAIN
    for command in ("live", "detect"):
        done = subprocess.run(
            [sys.executable, "-c", hidden, command, "run.mcap", "--log", "a.mcap"],
            capture_output=True,
            text=True,
            check=False,
            cwd=here,
        )
        assert done.returncode == 1
        assert "pip install 'planegrasp[foxglove]'" in " ".join(done.stderr.split())
        assert not (here / "a.mcap").exists()


def test_a_client_and_a_full_disk(here):
    """The log ends, the server and tracking go on; a client that comes late sees the objects."""
    port = free_port()
    process = subprocess.Popen(
        [
            *(sys.executable, "-c", _LIMITED, "live", "opencv:video.avi", "--json"),
            *("--log", "a.mcap", "--foxglove-address", f"127.0.0.1:{port}"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=with_video(here),
    )
    with process:
        try:
            wait_for(process, f"Foxglove may connect to ws://127.0.0.1:{port}")
            told = wait_for(process, "recording: a.mcap cannot be written any further: File too")
            assert "tracking goes on without the log a.mcap" in told
            with FoxgloveClient(f"ws://127.0.0.1:{port}") as client:
                client.subscribe([TOPICS.scene, TOPICS.color])
                topics = set()
                while topics != {TOPICS.scene, TOPICS.color}:
                    topics.add(client.receive()[0])
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=60)
        finally:
            process.kill()
    assert (process.returncode, "Traceback" in err) == (1, False), err
    result = json.loads(out)
    assert (result["stopped"], result["recorded"]) == ("signal", False)
    source = open_source(here / "a.mcap")
    assert "was cut off" in source.notes[0]
    assert len(list(source)) > 0


@pytest.mark.usefixtures("here")
def test_a_disk_that_hangs(here):
    """The program ends all the same, with what was written until then."""
    done = subprocess.run(
        [
            *(sys.executable, "-c", _HANGING, "live", "run.mcap", "--json"),
            *("--log", "a.mcap", "--foxglove-address", "127.0.0.1:0"),
        ],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        cwd=here,
    )
    assert (done.returncode, "Traceback" in done.stderr) == (1, False), done.stderr
    assert "recording: the log a.mcap has no end: the disk hangs" in done.stderr
    assert json.loads(done.stdout)["frames"] > 2
    assert 0 < len(list(open_source(here / "a.mcap"))) < FRAMES


def with_video(folder):
    from rendered_stream import write_video

    write_video(folder / "video.avi", [shot.frame for shot in shots()])
    return folder


def wait_for(process, text):
    while text not in (line := process.stderr.readline()):
        assert line, f"ended without {text!r}"
    return line
