"""What makes a grasp better or worse while a person holds the object, who is in its company.

A hand is seen from one side only, and moves. The more room there is to it the better; where there
is little, the same grasp a little aside may do. And what moves must be seen until it is gripped.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from planegrasp.geometry import RigidTransform
from planegrasp.robot import frames
from planegrasp.robot.collision import CollisionChecker, CollisionConfig
from planegrasp.robot.scene import Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.body import BoxBody
    from planegrasp.grasping.canonical import CanonicalGrasp
    from planegrasp.grasping.clearance import GripperShape
    from planegrasp.robot.model import Robot
    from planegrasp.robot.scene import Obstacle
    from planegrasp.robot.state import RobotState

    Float64Array = NDArray[np.float64]

__all__ = ["Company", "sidesteps"]

# Share of the score that a grasp loses at which the robot would touch the person.
_CROWDED = 0.7
# An object of which less is to be seen is found less and less reliably.
_ENOUGH = 0.8
# Points on each side of the object, in either direction, that are looked at.
_POINTS = 5
# Nearer to the camera than this share of the way there is only what carries the camera.
_NEAR_CAMERA = 0.25


class Company:
    """Judges postures of a robot beside a person.

    Args:
        robot: whose arm it is.
        state: of its other joints.
        person: obstacles that belong to the person.
        room: from which on more of it is no better [m].
        body: of the object.
        T_base_object: where it is.
        T_base_camera: where it is watched from; None where that is not known.
    """

    def __init__(
        self,
        robot: Robot,
        state: RobotState,
        person: tuple[Obstacle, ...],
        *,
        room: float,
        body: BoxBody,
        T_base_object: RigidTransform,
        T_base_camera: RigidTransform | None,
    ) -> None:
        self._robot, self._state, self._wanted = robot, state, room
        config = CollisionConfig(margin=room)
        self._checker = CollisionChecker(robot, Scene(person), state=state, config=config)
        self._data = mujoco.MjData(robot.model)
        self._points = np.empty((0, 3))
        if T_base_camera is not None:
            self._eye = np.asarray(T_base_camera.translation)
            self._points = _facing(body, T_base_object, self._eye)

    def figures(self, q: Float64Array, opening: float) -> dict[str, float]:
        """Of a posture (n) at the grasp: `room` [m] and, with a camera, `visible` (0 … 1)."""
        contact = self._checker.check(q, opening)
        room = self._wanted if contact is None else min(max(-contact.depth, 0.0), self._wanted)
        if not len(self._points):
            return {"room": room}
        return {"room": room, "visible": self._visible(q, opening)}

    def share(self, figures: dict[str, float]) -> float:
        """What is left of a posture's score beside the person, 0 … 1."""
        crowded = _CROWDED * (1.0 - figures["room"] / self._wanted)
        seen = min(figures.get("visible", 1.0) / _ENOUGH, 1.0)
        return (1.0 - crowded) * seen**2

    def _visible(self, q: Float64Array, opening: float) -> float:
        """How much of the object the robot does not hide."""
        robot, data = self._robot, self._data
        state = robot.with_opening(robot.with_arm(self._state, q), opening)
        data.qpos[:] = state.qpos
        mujoco.mj_kinematics(robot.model, data)
        T_world_base = frames.world_pose(robot.model, data, robot.base_frame)
        eye = T_world_base.apply(self._eye)
        rays = T_world_base.apply(self._points) - eye
        count = len(rays)
        geom, distance = np.empty(count, np.int32), np.empty(count)
        mujoco.mj_multiRay(
            robot.model,
            data,
            pnt=eye + _NEAR_CAMERA * rays.mean(axis=0),
            vec=(rays - _NEAR_CAMERA * rays.mean(axis=0)).ravel(),
            geomgroup=None,
            flg_static=1,
            bodyexclude=-1,
            geomid=geom,
            dist=distance,
            normal=None,
            nray=count,
            cutoff=mujoco.mjMAXVAL,
        )
        # Distances are in lengths of the rays, which end at the points.
        return float(np.mean((geom < 0) | (distance >= 1.0)))


def sidesteps(
    grasp: CanonicalGrasp, body: BoxBody, gripper: GripperShape, distance: float
) -> list[CanonicalGrasp]:
    """The grasp moved along the fingers' pads either way, where these stay on the object.

    Args:
        grasp: as it was taught.
        body: of the object.
        gripper: for the size of the pads.
        distance: by which it is moved [m].
    """
    found = []
    corners = np.asarray(grasp.T_object_gripper.inv().apply(body.corners))
    low, high = corners[:, 2].min(), corners[:, 2].max()
    for aside in (-distance, distance) if distance > 0 else ():
        if low <= aside - gripper.finger_half_height and aside + gripper.finger_half_height <= high:
            moved = grasp.T_object_gripper * RigidTransform.from_translation([0.0, 0.0, aside])
            found.append(replace(grasp, T_object_gripper=moved))
    return found


def _facing(body: BoxBody, T_base_object: RigidTransform, eye: Float64Array) -> Float64Array:
    """Points on the side of the object that is seen most of, N×3 in the base frame."""
    half = np.asarray(body.size) / 2
    towards = T_base_object.inv().apply(eye) - body.centre
    areas = np.prod(half) / half
    # Of each pair of sides one faces the camera.
    axis = int(np.argmax(np.abs(towards) * areas))
    grid = (np.arange(_POINTS) + 0.5) / _POINTS * 2.0 - 1.0
    points = np.stack(np.meshgrid(grid, grid, [np.sign(towards[axis])]), axis=-1).reshape(-1, 3)
    order = [i for i in range(3) if i != axis] + [axis]
    placed = np.empty_like(points)
    placed[:, order] = points
    return np.asarray(T_base_object.apply(placed * half + body.centre), dtype=np.float64)
