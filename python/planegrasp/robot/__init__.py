"""Robots: models, kinematics, collisions and motion. Needs the extra `robot`."""

import planegrasp.robot._dependencies  # noqa: F401
from planegrasp.robot.gripper import Gripper
from planegrasp.robot.model import Robot
from planegrasp.robot.state import RobotState

__all__ = ["Gripper", "Robot", "RobotState"]
