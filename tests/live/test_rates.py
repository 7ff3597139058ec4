"""Rates and latencies of a sliding window, against what was put in."""

from __future__ import annotations

import pytest

from planegrasp.live import RateMeter


def test_a_steady_stream():
    """A camera of 60 Hz, every second frame tracked, a detector that needs half a second."""
    meter = RateMeter(window=2.0)
    for i in range(200):
        rates = meter.add(i / 30, latency=0.005, read=2 * i, dropped=i, passes=i // 15)
    assert rates.camera == pytest.approx(60.0)
    assert rates.tracking == pytest.approx(30.0)
    assert rates.passes == pytest.approx(2.0, abs=0.5)
    assert rates.latency_p50 == rates.latency_p99 == pytest.approx(0.005)
    assert rates.dropped == 199


def test_one_slow_frame_is_seen_while_it_is_in_the_window():
    meter = RateMeter(window=1.0)
    found = [
        meter.add(i / 30, latency=0.1 if i == 40 else 0.002, read=i, dropped=0, passes=0)
        for i in range(100)
    ]
    assert all(rates.latency_p50 == pytest.approx(0.002) for rates in found)
    slow = [i for i, rates in enumerate(found) if rates.latency_p99 > 0.01]
    assert slow == list(range(40, 40 + len(slow)))
    assert 30 <= len(slow) <= 32


def test_a_rate_is_of_the_window():
    meter = RateMeter(window=1.0)
    for i in range(31):
        meter.add(i / 30, latency=0.0, read=i, dropped=0, passes=0)
    for i in range(31):
        rates = meter.add(1 + (i + 1) / 10, latency=0.0, read=31 + i, dropped=0, passes=0)
    assert rates.camera == rates.tracking == pytest.approx(10.0)


def test_the_first_frame_has_no_rate():
    rates = RateMeter().add(5.0, latency=0.003, read=1, dropped=0, passes=0)
    assert (rates.camera, rates.tracking, rates.latency_p50) == (0.0, 0.0, 0.003)
