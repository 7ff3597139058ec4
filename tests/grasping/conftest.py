"""A robot, a box with grasps, and where it stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plans import grasps_of, plan_for, with_grasps
from small_arms import SIX_DOF_MJCF, seven_dof_urdf

from planegrasp.body import BoxBody
from planegrasp.objects import ObjectModel
from planegrasp.robot import Robot
from planegrasp.simulation.experiment import facing
from planegrasp.simulation.objects import cracker_box


@pytest.fixture(scope="session")
def pr2():
    return Robot.pr2()


@pytest.fixture(scope="session")
def carton_model():
    """The cracker box with its four grasps."""
    model = cracker_box().model
    return replace(model, grasps=grasps_of(model.outer_body))


@pytest.fixture(scope="session")
def before_pr2(pr2):
    """T_base_object of something upright that faces the robot's head."""
    return facing(np.array([0.62, -0.12, 0.85]), pr2.T_base_camera(pr2.home).translation)


@pytest.fixture(scope="session")
def side_plan(pr2, carton_model, before_pr2):
    """A plan to take the box by its right side."""
    return plan_for(pr2, carton_model, "side", before_pr2)


@pytest.fixture(params=["six.xml", "seven.urdf"])
def other_robot(request, tmp_path):
    path = tmp_path / request.param
    if path.suffix == ".xml":
        path.write_text(SIX_DOF_MJCF)
        return Robot.from_file(path, gripper_frame="tool", finger_joints=("jaw",))
    path.write_text(seven_dof_urdf(fingers=True))
    fingers = ("left", "right")
    return Robot.from_file(path, gripper_frame="tool", base_frame="base", finger_joints=fingers)


@pytest.fixture
def card(photo):
    """A thin thing with a grasp at its side that small grippers can do."""
    body = BoxBody((0.12, 0.16, 0.02))
    model = ObjectModel.from_image("card", photo("coffee", width=160), width=0.12)
    model = replace(model, body=body, grasps=grasps_of(body, opening=0.05))
    return with_grasps(model, "side")


@pytest.fixture
def body(carton_model):
    return carton_model.outer_body
