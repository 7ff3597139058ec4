"""Colour meets the depth of its instant, whichever comes first."""

from __future__ import annotations

from planegrasp.io.pairing import FramePairing


def paired(*steps, gap=0.4, patience=1):
    """What comes out, for steps such as ("c", 1.0): colour or depth with its timestamp."""
    pairing = FramePairing(gap, patience)
    outs = []
    for kind, stamp in steps:
        bring = pairing.first if kind == "c" else pairing.second
        outs += bring(stamp, f"{kind}{stamp:.1f}")
    outs += [(stamp, colour, depth or "rest") for stamp, colour, depth in pairing.rest()]
    return [(colour, depth) for _, colour, depth in outs]


def test_either_may_come_first():
    assert paired(("c", 1), ("d", 1.1)) == [("c1.0", "d1.1")]
    assert paired(("d", 1.1), ("c", 1)) == [("c1.0", "d1.1")]


def test_lagging_colour_finds_its_depth():
    steps = [("d", 1), ("d", 2), ("c", 1), ("d", 3), ("c", 2), ("c", 3)]
    assert paired(*steps) == [("c1.0", "d1.0"), ("c2.0", "d2.0"), ("c3.0", "d3.0")]


def test_lagging_depth_finds_its_colour_within_the_patience():
    steps = [("c", 1), ("c", 2), ("c", 3), ("d", 1), ("d", 2), ("d", 3)]
    assert paired(*steps, patience=3) == [("c1.0", "d1.0"), ("c2.0", "d2.0"), ("c3.0", "d3.0")]
    assert paired(*steps, patience=1) == [("c1.0", None), ("c2.0", None), ("c3.0", "d3.0")]


def test_colour_without_partner_goes_when_it_is_clear_that_none_comes():
    assert paired(("c", 1), ("c", 2), ("d", 2)) == [("c1.0", None), ("c2.0", "d2.0")]
    assert paired(("c", 1), ("d", 2), ("c", 2), patience=9) == [("c1.0", None), ("c2.0", "d2.0")]


def test_the_nearest_is_found_where_another_one_comes_first():
    steps = [("d", 0.7), ("c", 1), ("d", 1), ("c", 2)]
    assert paired(*steps) == [("c1.0", "d1.0"), ("c2.0", "rest")]
    assert paired(("d", 0.7), ("c", 1), ("c", 2)) == [("c1.0", "d0.7"), ("c2.0", "rest")]
    assert paired(("d", 0.7), ("c", 1)) == [("c1.0", "d0.7")], "at the end"


def test_depth_is_used_once():
    steps = [("d", 1), ("c", 1), ("c", 1.2), ("c", 2)]
    assert paired(*steps) == [("c1.0", "d1.0"), ("c1.2", None), ("c2.0", "rest")]


def test_depth_that_stops_lets_colour_go_on():
    steps = [("d", 0), *(("c", float(i)) for i in range(4))]
    assert paired(*steps) == [("c0.0", "d0.0"), ("c1.0", None), ("c2.0", None), ("c3.0", "rest")]


def test_a_clock_that_goes_back_pairs_on():
    steps = [("d", 90), ("c", 90), ("d", 91), ("d", 1), ("c", 1), ("d", 2), ("c", 2)]
    assert paired(*steps) == [("c90.0", "d90.0"), ("c1.0", "d1.0"), ("c2.0", "d2.0")]
