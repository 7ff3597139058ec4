"""The OpenNI2 driver on the dummy device that comes with OpenNI2.

In processes of their own, which end without closing it: once it has given frames, that device may
crash OpenNI2 when it is closed.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from itertools import pairwise

import pytest

pytest.importorskip("openni", reason="openni is not installed")

from planegrasp.errors import MissingExtraError

PRELUDE = """
import json, os, sys, time
import numpy as np
from planegrasp.errors import *
from planegrasp.io.cameras import *
def done(**answer):
    print(json.dumps(answer), flush=True)
    os._exit(0)
def caught(action):
    try:
        action()
    except Exception as error:
        return f"{type(error).__name__}: {error}"
"""


def in_process(script):
    run = subprocess.run(
        [sys.executable, "-c", PRELUDE + script],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return json.loads(run.stdout)


@pytest.fixture(scope="module", autouse=True)
def _dummy():
    try:
        from planegrasp.io.cameras.openni import _load_library

        _load_library()
    except MissingExtraError as error:
        pytest.skip(str(error))
    failure = in_process("""
camera = open_camera("openni:Dummy")
done(error=caught(camera.open))
""")["error"]
    if failure:
        pytest.skip(f"OpenNI2 comes without its dummy device: {failure}")


def test_colour_and_depth():
    seen = in_process("""
started = time.time()
camera = open_camera("openni:Dummy")
with NewestFrame(camera) as live:
    frames = [live.next() for _ in range(10)]
    f = next(f for f in frames if f.depth is not None)
    done(
        color=f.color.shape, corner=f.color[0, 0].tolist(),
        depth=f.depth.shape, row=f.depth[0].tolist(), ball=float(f.depth[f.depth > 0].min()),
        stamps=[f.timestamp - started for f in frames], now=time.time() - started,
        fx=f.camera.fx, notes=live.notes,
    )
""")
    assert seen["color"] == [240, 320, 3]
    assert seen["corner"] == [0, 0, 255], "blue, as RGB"
    assert seen["depth"] == [240, 320]
    assert seen["row"] == [2.0] * 320, "metres"
    assert 0.1 < seen["ball"] < 2.0, "a ball flies before it"
    stamps = seen["stamps"]
    assert all(a < b for a, b in pairwise(stamps))
    assert 0 <= stamps[0] <= seen["now"], "of this computer's clock"
    assert seen["fx"] == pytest.approx(160 / math.tan(math.radians(30)))
    assert "does not align depth" in seen["notes"][0]
    assert "assuming a horizontal field of view of 60°" in seen["notes"][1]


def test_given_intrinsics():
    seen = in_process("""
from planegrasp.geometry import PinholeCamera
given = PinholeCamera(320, 240, 300.0, 300.0, 159.5, 119.5)
with NewestFrame(open_camera("openni:Dummy", camera=given)) as live:
    done(same=live.next().camera == given, notes=live.notes)
""")
    assert seen["same"]
    assert len(seen["notes"]) == 1


def test_what_is_not_there():
    seen = in_process("""
done(
    nothing=caught(open_camera("openni:Nope").open),
    unopened=caught(open_camera("openni:Dummy").read),
    size=caught(open_camera("openni:Dummy", width=640, height=480).open),
    rate=caught(open_camera("openni:Dummy", frames_per_second=60).open),
)
""")
    assert seen["nothing"].startswith("CameraLostError: openni:Nope does not start: ")
    assert "Couldn't open device 'Nope'" in seen["nothing"]
    assert seen["unopened"] == "CameraLostError: openni:Dummy is not open"
    assert seen["size"] == (
        "CameraError: openni:Dummy has no images of 640×480 at 30 Hz; it gives 320×240 at 30 Hz"
    )
    assert "at 60 Hz; it gives 320×240 at 30 Hz" in seen["rate"]
