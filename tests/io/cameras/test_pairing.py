"""Colour meets the depth of its instant, whichever comes first."""

from __future__ import annotations

from planegrasp.io.cameras.pairing import FramePairing


def paired(*steps, gap=0.4):
    """What comes out, for steps such as ("c", 1.0): colour or depth with its timestamp."""
    pairing = FramePairing(gap)
    outs = []
    for kind, stamp in steps:
        bring = pairing.first if kind == "c" else pairing.second
        outs.append(bring(stamp, f"{kind}{stamp:.1f}"))
    return [(out[1], out[2]) for out in outs if out is not None]


def test_either_may_come_first():
    assert paired(("c", 1), ("d", 1.1)) == [("c1.0", "d1.1")]
    assert paired(("d", 1.1), ("c", 1)) == [("c1.0", "d1.1")]


def test_a_lagging_stream_finds_its_partners():
    steps = [("d", 1), ("d", 2), ("c", 1), ("d", 3), ("c", 2), ("c", 3)]
    assert paired(*steps) == [("c1.0", "d1.0"), ("c2.0", "d2.0"), ("c3.0", "d3.0")]


def test_colour_without_partner_goes_when_the_next_one_comes():
    assert paired(("c", 1), ("c", 2), ("d", 2)) == [("c1.0", None), ("c2.0", "d2.0")]
    assert paired(("d", 1), ("c", 1.5), ("c", 2.5)) == [("c1.5", None)]


def test_depth_is_used_once():
    assert paired(("d", 1), ("c", 1), ("c", 1.2), ("c", 2)) == [("c1.0", "d1.0"), ("c1.2", None)]


def test_depth_that_stops_lets_colour_go_on():
    steps = [("d", 0), *(("c", float(i)) for i in range(5))]
    assert paired(*steps) == [("c0.0", "d0.0"), ("c1.0", None), ("c2.0", None), ("c3.0", None)]
