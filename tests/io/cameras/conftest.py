"""Waiting for what another thread does."""

from __future__ import annotations

import time

import pytest


@pytest.fixture
def until():
    """Wait until a condition holds; the limit is for a thread that hangs, not a measure."""

    def wait(condition, limit=30.0):
        end = time.monotonic() + limit
        while not condition():
            assert time.monotonic() < end, "waited in vain"
            time.sleep(0.002)

    return wait
