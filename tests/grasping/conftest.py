"""A robot, a box with grasps, and where it stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from plans import grasps_of, plan_for

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
