"""Detections and plans that tests of grasping start from."""

from dataclasses import replace

import numpy as np

from planegrasp.detection import Detection
from planegrasp.grasping import CanonicalGrasp
from planegrasp.grasping.planner import GraspPlanner
from planegrasp.pose.base import PoseEstimate
from planegrasp.simulation.showing import SIDES, hold_at

# 2 mm and 0.5° in every direction.
COVARIANCE = np.diag([0.002**2] * 3 + [np.radians(0.5) ** 2] * 3)


def grasps_of(body, opening=0.085):
    return [CanonicalGrasp(side, hold_at(body, side), opening) for side in SIDES]


def with_grasps(model, *names):
    return replace(model, grasps=[g for g in model.grasps if g.name in names])


def detection_of(model, T_camera_object, covariance=COVARIANCE, **pose):
    values = {"ambiguous": False, "alternative": None, "depth_pixels": 5000, **pose}
    estimate = PoseEstimate(T_camera_object, covariance, reprojection_rms=0.3, **values)
    return Detection(model, 0, (), 1.0, estimate)


def plan_for(robot, model, name, T_base_object, **arguments):
    plan = GraspPlanner(robot).plan_at(with_grasps(model, name), T_base_object, **arguments)
    assert plan, plan.reasons
    return plan


def within_reach(robot, model):
    """T_base_object at which a posture near the arm's home holds it by its first grasp."""
    q = robot.arm(robot.home) + np.array([0.3, 0.2, 0.4, 0.3, 0.5, 0.2, 0.2])[: robot.n]
    T_base_gripper = robot.T_base_gripper(robot.with_arm(robot.home, q))
    return T_base_gripper * model.grasps[0].T_object_gripper.inv()
