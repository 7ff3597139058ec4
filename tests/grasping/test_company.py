"""Room, sight and steps aside, against boxes and cameras whose places are known."""

import numpy as np
import pytest
from plans import grasps_of

from planegrasp.body import BoxBody
from planegrasp.geometry import RigidTransform
from planegrasp.grasping.clearance import GripperShape
from planegrasp.grasping.company import Company, sidesteps
from planegrasp.robot.scene import Obstacle

AT = RigidTransform.from_translation
BODY = BoxBody((0.16, 0.21, 0.06))


def company(pr2, hand=1.0, camera=None):
    """A hand so far in front of the fingertips, which are at home."""
    tip = pr2.T_base_gripper(pr2.home)
    box = Obstacle("hand", (0.02, 0.2, 0.1), tip * AT([0.015 + hand + 0.01, 0.0, 0.0]))
    return Company(
        pr2,
        pr2.home,
        (box,),
        room=0.1,
        body=BODY,
        T_base_object=tip * AT([0.3, 0.0, 0.0]),
        T_base_camera=camera,
    )


def test_room_is_the_distance_to_the_person(pr2):
    q = pr2.arm(pr2.home)
    rooms = [company(pr2, hand).figures(q, 0.06)["room"] for hand in (0.02, 0.05, 0.09, 0.3)]
    assert np.diff(rooms[:3]) == pytest.approx([0.03, 0.04], abs=1e-4)
    assert rooms[3] == 0.1
    shares = [company(pr2).share({"room": room}) for room in rooms]
    assert np.all(np.diff(shares) > 0)
    assert shares[-1] == 1.0


def test_what_the_arm_hides_is_not_visible(pr2):
    q, tip = pr2.arm(pr2.home), pr2.T_base_gripper(pr2.home)
    # From behind the wrist the hand is in front of the object, from the other side it is not.
    behind, beyond = tip * AT([-0.5, 0.0, 0.0]), tip * AT([1.5, 0.0, 0.0])
    hidden = company(pr2, camera=behind).figures(q, 0.06)
    clear = company(pr2, camera=beyond).figures(q, 0.06)
    assert hidden["visible"] < 0.7
    assert clear["visible"] == 1.0
    judge = company(pr2)
    assert judge.share({"room": 0.1, "visible": 0.5}) < 0.5
    assert judge.share(clear) == judge.share({"room": 0.1}) == 1.0
    # Where nobody watches, nothing is hidden.
    assert "visible" not in company(pr2).figures(q, 0.06)


def test_a_grasp_is_moved_along_the_pads_and_stays_on_the_object():
    shape = GripperShape()
    for grasp in grasps_of(BODY):
        moved = sidesteps(grasp, BODY, shape, 0.015)
        offsets = [(grasp.T_object_gripper.inv() * g.T_object_gripper).as_matrix() for g in moved]
        assert [round(float(T[2, 3]), 9) for T in offsets] == [-0.015, 0.015]
        for T, other in zip(offsets, moved, strict=True):
            np.testing.assert_allclose(T[:3, :3], np.eye(3), atol=1e-12)
            np.testing.assert_allclose(T[:2, 3], 0.0, atol=1e-12)
            assert (other.name, other.opening) == (grasp.name, grasp.opening)
        assert sidesteps(grasp, BODY, shape, 0.0) == []
        # Farther than half the object there is nothing to hold.
        assert sidesteps(grasp, BODY, shape, 0.11) == []
    narrow = BoxBody((0.022, 0.022, 0.022))
    assert all(sidesteps(grasp, narrow, shape, 0.005) == [] for grasp in grasps_of(narrow))
