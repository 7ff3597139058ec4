"""Robots: models, kinematics, collisions and motion. Needs the extra `robot`."""

import planegrasp.robot._dependencies  # noqa: F401
from planegrasp.robot.collision import CollisionChecker, CollisionConfig, Contact
from planegrasp.robot.gripper import Gripper
from planegrasp.robot.ik import IKConfig, IKResult, IKSolution
from planegrasp.robot.kinematics import Kinematics
from planegrasp.robot.model import Robot
from planegrasp.robot.motion import MotionConfig, plan_path, straight_line
from planegrasp.robot.path import MotionFailure, Path
from planegrasp.robot.scene import ObjectBody, Obstacle, Scene
from planegrasp.robot.state import RobotState
from planegrasp.robot.trajectory import Trajectory, time_parameterise

__all__ = [
    "CollisionChecker",
    "CollisionConfig",
    "Contact",
    "Gripper",
    "IKConfig",
    "IKResult",
    "IKSolution",
    "Kinematics",
    "MotionConfig",
    "MotionFailure",
    "ObjectBody",
    "Obstacle",
    "Path",
    "Robot",
    "RobotState",
    "Scene",
    "Trajectory",
    "plan_path",
    "straight_line",
    "time_parameterise",
]
