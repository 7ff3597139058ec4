"""Frame after frame the detector needs the memory that it has."""

import os
from pathlib import Path

import numpy as np
import pytest

from planegrasp.bench.scenes import facing_pose, rectangles
from planegrasp.bench.textures import backgrounds
from planegrasp.detector import Detector, DetectorConfig
from planegrasp.geometry import PinholeCamera
from planegrasp.simulation import render

STATM = Path("/proc/self/statm")
CAMERA = PinholeCamera(320, 240, 262.5, 262.5, 159.5, 119.5, ())
WARM_UP, FRAMES = 100, 300


def resident():
    """Memory of this process that is in use [MB]."""
    return int(STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.skipif(not STATM.exists(), reason="needs /proc/self/statm (Linux)")
def test_some_hundred_frames_take_no_more_memory(book):
    rng = np.random.default_rng(0)
    poses = [facing_pose(np.array([0.0, 0.0, z]), 0.5, 0.4, z) for z in (0.4, 0.5, 0.6, 2.0)]
    background = backgrounds()[4]
    scenes = (render(rectangles(book, T), CAMERA, rng, background=background) for T in poses)
    frames = [scene.frame for scene in scenes]
    detector = Detector([book], DetectorConfig())
    found = sum(len(detector.detect(frames[i % 4])) for i in range(WARM_UP))
    assert found >= WARM_UP / 2
    before = resident()
    for i in range(FRAMES):
        detector.detect(frames[i % 4])
    # One lost descriptor list a frame, some 100 kB, would come to 30 MB; the allocator's own
    # fragments come to less than a few.
    assert resident() - before < 10
