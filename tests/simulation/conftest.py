"""Robots and an object for the simulated world."""

from pathlib import Path

import pytest

from planegrasp.robot import Robot
from planegrasp.simulation.objects import cracker_box


@pytest.fixture(scope="session")
def gripper():
    return Robot.from_file(
        Path(__file__).parent / "gripper.xml",
        gripper_frame="tool",
        base_frame="base",
        finger_joints=("left", "right"),
        camera_frame="eye",
        home="home",
    )


@pytest.fixture(scope="session")
def pr2():
    return Robot.pr2()


@pytest.fixture(scope="session")
def box():
    return cracker_box().model
