"""Distances to what moves, against boxes whose places are known."""

import numpy as np
import pytest

from planegrasp.geometry import RigidTransform
from planegrasp.grasping.nearby import Nearby
from planegrasp.robot.path import Path
from planegrasp.robot.scene import ObjectBody, Obstacle, Scene

MARGIN, ROOM = 0.004, 0.05
AT = RigidTransform.from_translation


@pytest.fixture
def tip(pr2):
    """T_base_gripper at home."""
    return pr2.T_base_gripper(pr2.home)


def nearby(pr2, tip, gap, *, carried=True):
    """A cube in front of the fingertips, a gap away, and an object far away."""
    cube = Obstacle("cube", (0.04, 0.3, 0.1), tip * AT([0.015 + gap + 0.02, 0.0, 0.0]))
    body = ObjectBody((0.05, 0.05, 0.05), tip * AT([1.0, 0.0, 0.0]))
    names = ("cube",) if carried else ()
    return body.T_base_object, Nearby(
        pr2, pr2.home, Scene((cube,)), body, carried=names, opening=0.06, margin=MARGIN, room=ROOM
    )


def test_the_distance_is_that_of_what_moves_along(pr2, tip):
    q = pr2.arm(pr2.home)
    T_base_object, around = nearby(pr2, tip, 0.03)
    around.place(T_base_object)
    far = around.distance(q)
    for step in (0.01, 0.02):
        around.place(tip * AT([-step, 0.0, 0.0]) * tip.inv() * T_base_object)
        assert around.distance(q) == pytest.approx(far - step, abs=1e-4)
    around.place(tip * AT([0.2, 0.0, 0.0]) * tip.inv() * T_base_object)
    assert around.closest(q) is None
    assert around.distance(q) == ROOM


def test_what_stands_still_counts_with_the_margin_only(pr2, tip):
    q = pr2.arm(pr2.home)
    T_base_object, around = nearby(pr2, tip, 0.003, carried=False)
    around.place(T_base_object)
    assert around.distance(q) == ROOM
    assert around.contact(q).second == "cube"
    # It does not go with the object either.
    around.place(AT([0.5, 0.0, 0.0]) * T_base_object)
    assert around.contact(q).second == "cube"


def test_the_fingers_may_be_at_the_object_they_reach_for(pr2, tip):
    q = pr2.arm(pr2.home)
    _, around = nearby(pr2, tip, 0.2)
    # As wide as the opening: a finger on either side.
    around.place(tip * AT([0.015, 0.0, 0.0]))
    assert around.contact(q) is None or around.contact(q).second == "object"
    assert around.distance(q) < 0.02
    assert around.contact(q, reaching=True) is None
    assert around.distance(q, reaching=True) > 0.02


def test_half_of_the_room_is_kept(pr2, tip):
    q = pr2.arm(pr2.home)
    path = Path(np.array([q, q]))
    for gap in (0.03, 0.004, 0.2):
        T_base_object, around = nearby(pr2, tip, gap)
        around.place(T_base_object)
        kept = around.kept(path)
        assert kept == max(MARGIN, around.distance(q) / 2)
        assert MARGIN <= kept <= ROOM / 2
