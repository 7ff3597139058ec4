"""A short stream of three objects, rendered once."""

from __future__ import annotations

import pytest

from planegrasp.bench.stream import StreamSettings, models, stream
from planegrasp.detector import Detector


@pytest.fixture(scope="session")
def three():
    """Models, a detector of them, and twenty frames with their truth."""
    config = StreamSettings(seconds=20 / 30, objects=3, seed=6)
    objects = models(config)
    return objects, Detector(objects), list(stream(config))
