"""The benchmark of ROS 2, with tiny settings and both peers."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("cyclonedds")

from ros2_proof import built_peer

from planegrasp.bench import ros2
from planegrasp.bench.ros2_restarts import Restarts


@pytest.mark.parametrize("peer", ["another DDS", "the same DDS"])
def test_latency_and_a_killed_peer(peer):
    program = built_peer() if peer == "another DDS" else None
    settings = ros2.Ros2Settings(frames=360, kills=1, latency_frames=20, program=program)
    steps = []
    result = ros2.run(0, settings, lambda: steps.append(1))
    assert len(steps) == settings.steps
    figures = json.loads(result.to_json())["figures"]
    assert figures["frames"] == 360
    assert figures["restarts"] == figures["received_again"] == 1
    assert figures["seconds_to_receive_max"] > 0
    assert 0 < figures["added_ms_median"] <= figures["added_ms_p99"]
    assert figures["in_process_ms_median"] > 0
    assert {row["ms"] for row in result.rows} >= {"added", "arriving", "leaving"}


def test_growth_is_that_after_a_tenth_of_the_frames():
    memory = (0.0, *[100.0] * 9, *np.linspace(100.0, 110.0, 90))
    restarts = Restarts(100, (), (), 0.0, 0, memory)
    assert 7.0 < restarts.growth < 10.0
    assert Restarts(100, (), (), 0.0, 0, (0.0, *[5.0] * 9)).growth == 0.0
