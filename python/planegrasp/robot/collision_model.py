"""The MuJoCo model in which collisions are looked for: robot, obstacles and object."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.robot import frames, loading
from planegrasp.robot.scene import OBJECT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.robot.model import Robot
    from planegrasp.robot.scene import Obstacle, Scene
    from planegrasp.robot.state import RobotState

# No model uses such names; an obstacle may then be called like one of the robot's links.
PREFIX = "planegrasp/"
LYING, HELD = f"{PREFIX}lying {OBJECT}", f"{PREFIX}held {OBJECT}"
_EVERYTHING = 0x7FFFFFFF


def build_collision_model(robot: Robot, scene: Scene, margin: float) -> mujoco.MjModel:
    """Compile the robot with boxes for the obstacles and, twice, for the object.

    The object is there as a body that lies (`LYING`) and as one that hangs on the gripper (`HELD`),
    so that it can be taken without compiling again; `place_object` poses and enables them,
    `place_obstacles` poses the others.
    Obstacles do not collide with each other, nor with what of the robot never moves.

    Obstacles and the lying object are larger by the margin on every side: of boxes that are closer
    than a margin of its own, MuJoCo misses some.
    """
    spec = robot.spec()
    for obstacle in scene.obstacles:
        _add_box(spec.worldbody, PREFIX + obstacle.name, obstacle.size, margin)
    if scene.object is not None:
        gripper = robot.model.body(frames.body_of(robot.model, robot.gripper_frame)).name
        _add_box(spec.worldbody, LYING, scene.object.size, margin)
        _add_box(spec.body(gripper), HELD, scene.object.size, 0.0)
    model = loading.compile_spec(spec, f"{robot.path} with the scene")
    model.geom_margin[:] = model.geom_gap[:] = 0.0
    return model


def place_object(model: mujoco.MjModel, robot: Robot, scene: Scene, state: RobotState) -> None:
    """Pose the scene's object in the model, whose object has the same size, and enable it."""
    body = scene.object
    if body is None:
        return
    T_object_box = RigidTransform.from_translation(body.centre)
    if body.T_base_object is not None:
        T_parent_box = world_base(robot, state) * body.T_base_object * T_object_box
    else:
        assert body.T_gripper_object is not None
        T_parent_box = _body_gripper(robot) * body.T_gripper_object * T_object_box
    here = LYING if body.T_base_object is not None else HELD
    for name in (LYING, HELD):
        index = model.body(name).id
        geom = int(model.body_geomadr[index])
        mask = _EVERYTHING if name == here else 0
        model.geom_contype[geom] = model.geom_conaffinity[geom] = mask
        if name == here:
            _place(model, index, T_parent_box)


def place_obstacles(
    model: mujoco.MjModel, obstacles: Sequence[Obstacle], T_world_base: RigidTransform
) -> None:
    """Pose obstacles of the model where a base at this pose has them."""
    if obstacles:
        # All at once: products of single transforms take longer than a check.
        index = [model.body(PREFIX + box.name).id for box in obstacles]
        places = np.array([box.T_base_box.translation for box in obstacles])
        turns = Rotation.concatenate([box.T_base_box.rotation for box in obstacles])
        model.body_pos[index] = T_world_base.apply(places)
        model.body_quat[index] = (T_world_base.rotation * turns).as_quat(scalar_first=True)


def body_names(model: mujoco.MjModel) -> list[str]:
    """Names of all bodies, "body 7" where one has none."""
    found = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, i) for i in range(model.nbody)]
    return [name or f"body {i}" for i, name in enumerate(found)]


def world_base(robot: Robot, state: RobotState) -> RigidTransform:
    """T_world_base of a robot whose joints are as in a state."""
    data = mujoco.MjData(robot.model)
    data.qpos[:] = state.qpos
    mujoco.mj_kinematics(robot.model, data)
    return frames.world_pose(robot.model, data, robot.base_frame)


def _place(model: mujoco.MjModel, body: int, T_parent_body: RigidTransform) -> None:
    model.body_pos[body] = T_parent_body.translation
    model.body_quat[body] = T_parent_body.rotation.as_quat(scalar_first=True)


def _add_box(
    parent: mujoco.MjsBody,
    name: str,
    size: tuple[float, float, float],
    margin: float,
) -> None:
    parent.add_body(name=name).add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=np.array(size) / 2 + margin,
        mass=0.0,
        contype=_EVERYTHING,
        conaffinity=_EVERYTHING,
    )


def _body_gripper(robot: Robot) -> RigidTransform:
    """T_body_gripper: where the gripper frame is on its body."""
    model = robot.model
    kind, index = loading.find(model, frames.FRAMES, robot.gripper_frame, "gripper frame")
    if kind == "body":
        return RigidTransform.identity()
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, model.site_quat[index])
    return frames.pose(model.site_pos[index], matrix)
