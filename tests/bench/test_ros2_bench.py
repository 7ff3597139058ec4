"""The benchmark of ROS 2, with tiny settings and both peers."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("cyclonedds")

from ros2_proof import built_peer

from planegrasp.bench import ros2
from planegrasp.bench.ros2_peer import Endpoint
from planegrasp.bench.ros2_restarts import Restarts, _Restarted
from planegrasp.errors import InvalidInputError, PlanegraspError


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


def test_more_kills_than_frames():
    with pytest.raises(InvalidInputError, match=r"150 kills need at least 151 frames.*got 100"):
        ros2.Ros2Settings(frames=100, kills=150)


def test_each_kill_counts_however_soon_it_comes():
    with _Restarted(71, [Endpoint("/never", "std_msgs/msg/String")], None) as restarted:
        for _ in range(3):
            restarted.kill()
        again = restarted.finish()
    assert len(again) == 4, "the first start, and one after each kill"
    assert np.isnan(again).all()


@pytest.mark.parametrize(
    ("mode", "reason"), [(0o755, "did not start as a peer"), (0o644, r"\(Permission denied\)")]
)
def test_a_peer_that_does_not_start(tmp_path, mode, reason):
    program = tmp_path / "peer"
    program.write_text("#!/bin/sh\nexit 1\n")
    program.chmod(mode)
    with (
        _Restarted(72, [], program) as restarted,
        pytest.raises(PlanegraspError, match=reason),
    ):
        restarted.finish()


def test_growth_is_that_after_a_tenth_of_the_frames():
    memory = (0.0, *[100.0] * 9, *np.linspace(100.0, 110.0, 90))
    restarts = Restarts(100, (), (), 0.0, 0, memory)
    assert 7.0 < restarts.growth < 10.0
    assert Restarts(100, (), (), 0.0, 0, (0.0, *[5.0] * 9)).growth == 0.0
