"""A short stream and what a live system sees in it, once for all tests."""

from __future__ import annotations

from dataclasses import replace

import pytest

pytest.importorskip("foxglove")

from recorded_frames import START
from rendered_stream import processed, shots, taught

from planegrasp.detector import Detector

_FRAMES = 6


@pytest.fixture(scope="session")
def watched():
    """Models, a detector of them, and what is seen in some frames."""
    objects = taught(1)
    detector = Detector(objects)
    frames = [
        replace(shot.frame, timestamp=START + shot.frame.timestamp) for shot in shots(1)[:_FRAMES]
    ]
    return objects, detector, processed(detector, frames)
