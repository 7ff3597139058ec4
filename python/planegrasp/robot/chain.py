"""The arm alone: a small MuJoCo model from base to gripper, in which only the arm moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from planegrasp.robot import frames, loading

if TYPE_CHECKING:
    from planegrasp.robot.model import Robot
    from planegrasp.robot.state import RobotState

GRIPPER_SITE = "gripper"


def arm_chain(robot: Robot, state: RobotState) -> mujoco.MjModel:
    """The arm as a model of its own, whose world is the robot's base frame.

    Its n joints have the names, order and coordinates of `robot.arm_joints` and the soft limits;
    all other joints stand still as they are in `state`. Fewer joints and no shapes make kinematics
    several times faster than the whole robot's.

    Returns:
        A model with a site `GRIPPER_SITE` in the gripper frame. Its masses are placeholders.
    """
    model = robot.model
    arm = [model.joint(name).id for name in robot.arm_joints]
    at_zero = robot.with_arm(state, model.qpos0[model.jnt_qposadr[arm]])
    data = mujoco.MjData(model)
    data.qpos[:] = at_zero.qpos
    mujoco.mj_kinematics(model, data)

    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    parent = spec.worldbody
    T_world_parent = frames.world_pose(model, data, robot.base_frame)
    for body in _path(model, robot):
        T_world_body = frames.pose(data.xpos[body], data.xmat[body])
        T_parent_body = T_world_parent.inv() * T_world_body
        parent = parent.add_body(
            pos=T_parent_body.translation,
            quat=T_parent_body.rotation.as_quat(scalar_first=True),
            mass=1.0,
            inertia=[1.0, 1.0, 1.0],
            explicitinertial=True,
        )
        first = int(model.body_jntadr[body])
        for joint in range(first, first + int(model.body_jntnum[body])):
            if joint in arm:
                _add_joint(parent, robot, arm.index(joint), joint)
        T_world_parent = T_world_body
    T_body_gripper = T_world_parent.inv() * frames.world_pose(model, data, robot.gripper_frame)
    parent.add_site(
        name=GRIPPER_SITE,
        pos=T_body_gripper.translation,
        quat=T_body_gripper.rotation.as_quat(scalar_first=True),
    )
    return loading.compile_spec(spec, f"the arm of {robot.path}")


def longest_reach(chain: mujoco.MjModel) -> float:
    """How far the gripper frame can be from the anchor of the first joint, at most [m].

    A bound, not the workspace: the lengths between joints in a row, whatever their limits.
    """
    data = mujoco.MjData(chain)
    mujoco.mj_kinematics(chain, data)
    points = np.vstack([data.xanchor, data.site_xpos])
    reach = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    slides = chain.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
    return reach + float(np.abs(chain.jnt_range[slides]).max(axis=1, initial=0.0).sum())


def _add_joint(body: mujoco.MjsBody, robot: Robot, index: int, joint: int) -> None:
    model = robot.model
    limited = not robot.continuous[index]
    body.add_joint(
        name=robot.arm_joints[index],
        type=int(model.jnt_type[joint]),
        axis=model.jnt_axis[joint],
        pos=model.jnt_pos[joint],
        ref=float(model.qpos0[model.jnt_qposadr[joint]]),
        limited=limited,
        range=[robot.soft_lower[index], robot.soft_upper[index]] if limited else [0.0, 0.0],
    )


def _path(model: mujoco.MjModel, robot: Robot) -> list[int]:
    """Bodies from the base frame's (exclusive) to the gripper frame's (inclusive)."""
    base, body = (frames.body_of(model, frame) for frame in (robot.base_frame, robot.gripper_frame))
    path = []
    while body != base:
        path.append(body)
        body = int(model.body_parentid[body])
    return path[::-1]
