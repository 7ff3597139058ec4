"""Plans and refusals as messages of ROS."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("cyclonedds")

from ros2_examples import HEADER, plan, refusal

from planegrasp.errors import InvalidInputError
from planegrasp.io.ros2 import GraspTopics
from planegrasp.io.ros2.dds import dds_type
from planegrasp.io.ros2.grasp_conversions import grasp_pose, joint_trajectory, verdicts_array


def values(status):
    return {pair.key: float(pair.value) for pair in status.values}


def test_verdicts_of_a_plan():
    message = verdicts_array(dds_type, plan())
    assert message.header.frame_id == "base_link"
    whole, side, top = message.status
    assert (whole.level, whole.name, whole.message) == (0, "bücher", "side")
    assert values(whole) == {"opening": 0.06, "force": 40.0}
    assert (side.level, side.name, side.message) == (0, "bücher/side", "")
    assert values(side) == {"score": 0.8, "clearance": 0.01, "limit_margin": 1 / 3}
    assert (top.level, top.name, top.message) == (2, "bücher/top", "out of reach by 0.2 m")


def test_verdicts_of_a_refusal():
    whole, side = verdicts_array(dds_type, refusal()).status
    assert (whole.level, whole.message, whole.values) == (2, "no grasp can be done", [])
    assert (side.level, side.message) == (2, "out of reach by 0.2 m")
    assert values(side)["position_error"] == 0.2


def test_path():
    message = joint_trajectory(dds_type, HEADER, plan().joints, plan().move)
    assert message.joint_names == ["shoulder", "elbow"]
    assert [tuple(point.positions) for point in message.points] == list(plan().move)
    assert all(p.velocities == [] and p.time_from_start.sec == 0 for p in message.points)


def test_poses():
    message = grasp_pose(dds_type, HEADER, plan().gripper_pose)
    p, q = message.pose.position, message.pose.orientation
    assert (p.x, p.y, p.z) == plan().gripper_pose.position
    assert (q.x, q.y, q.z, q.w) == plan().gripper_pose.orientation
    none = grasp_pose(dds_type, HEADER, None).pose
    q = none.orientation
    assert np.isnan([none.position.x, none.position.y, none.position.z, q.x, q.y, q.z, q.w]).all()


def test_topics():
    assert GraspTopics().pose("pregrasp") == "/planegrasp/grasp/pregrasp_pose"
    assert GraspTopics("/arm").path("lift") == "/arm/lift"
    with pytest.raises(InvalidInputError, match="'arm' is no name of a ROS topic"):
        GraspTopics("arm")
