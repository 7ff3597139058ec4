"""Whether the robot touches itself, its surroundings or the object: by MuJoCo."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform
from planegrasp.robot.collision_model import (
    HELD,
    LYING,
    PREFIX,
    body_names,
    build_collision_model,
    place_object,
    place_obstacles,
    world_base,
)
from planegrasp.robot.scene import OBJECT, ObjectBody, Scene

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike

    from planegrasp.robot.model import Robot
    from planegrasp.robot.state import RobotState

    Pair = frozenset[str]


@dataclass(frozen=True, slots=True)
class CollisionConfig:
    """How much room the robot keeps.

    Attributes:
        margin: of the robot and what it holds from obstacles, and of the robot from an object that
            it does not hold [m]. The robot keeps none from itself.
    """

    margin: float = 0.005

    def __post_init__(self) -> None:
        if not (np.isfinite(self.margin) and self.margin >= 0):
            raise InvalidInputError(f"margin must be ≥ 0 m and finite, got {self.margin}")


@dataclass(frozen=True, slots=True)
class Contact:
    """Two things that touch, or are closer than the margin.

    Attributes:
        first: a body of the robot, or the object that it holds.
        second: a body of the robot, an obstacle or the object.
        depth: how deep they are in each other [m]; negative: how far they are apart.
    """

    first: str
    second: str
    depth: float

    def __str__(self) -> str:
        if self.depth > 0:
            return f"{self.first} is {1000 * self.depth:.0f} mm deep in {self.second}"
        return f"{self.first} is only {-1000 * self.depth:.0f} mm away from {self.second}"


class CollisionChecker:
    """Checks postures of a robot in a scene.

    What never counts: neighbouring links, fingers with each other, what touches at `robot.home`,
    the palm with what it holds. Things are called by the name of their body, obstacles by theirs.
    Not to be shared between threads.

    Args:
        robot: the robot.
        scene: what is around it.
        state: where the other joints are; `robot.home` by default.
        config: how much room to keep.

    Attributes:
        fingers: names of the bodies of the fingers.
        fingers_on_object: pairs to allow while the gripper grasps: each finger with the object.
    """

    def __init__(
        self,
        robot: Robot,
        scene: Scene | None = None,
        *,
        state: RobotState | None = None,
        config: CollisionConfig | None = None,
    ) -> None:
        self.robot = robot
        self.scene = Scene() if scene is None else scene
        self.state = robot.home if state is None else state
        self.config = CollisionConfig() if config is None else config
        joints = robot.gripper.joints if robot.gripper is not None else ()
        bodies = body_names(robot.model)
        self.fingers = frozenset(bodies[int(robot.model.joint(j).bodyid[0])] for j in joints)
        self.fingers_on_object = frozenset(frozenset((finger, OBJECT)) for finger in self.fingers)
        self._T_world_base = world_base(robot, self.state)
        self._moved = frozenset[str](), RigidTransform.identity()
        self._build()
        self._never = frozenset(frozenset((a, b)) for a in self.fingers for b in self.fingers)
        self._never |= self._touching_at_home()

    def set_object(self, body: ObjectBody | None) -> None:
        """Replace the scene's object: lying somewhere else, held, or none.

        Nothing is compiled anew as long as its size stays the same.

        Raises:
            InvalidInputError: for supports that the scene does not have.
        """
        before = self.scene.object
        self.scene = self.scene.with_object(body)
        if body is not None and before is not None and body.size == before.size:
            place_object(self._model, self.robot, self.scene, self.state)
        else:
            self._build()

    def move_obstacles(self, names: Iterable[str], T_base: RigidTransform) -> None:
        """Put obstacles elsewhere, all others where the scene has them; nothing is compiled anew.

        Args:
            names: of the obstacles that move.
            T_base: that takes points of them, in the base frame, from where the scene has them to
                where they are.

        Raises:
            InvalidInputError: for obstacles that the scene does not have.
        """
        moved = frozenset(names)
        self.scene.check_names(moved)
        self._moved = moved, T_base
        self._place_obstacles()

    def check(
        self, q: ArrayLike, opening: float | None = None, *, allowed: Iterable[Pair] = ()
    ) -> Contact | None:
        """The deepest contact of the robot, and of the object it holds; None without any.

        Args:
            q: the arm's joints, n.
            opening: of the gripper [m]; as in the state by default.
            allowed: pairs of names that may touch besides, such as `fingers_on_object`.
        """
        data = self._data
        data.qpos[self._arm] = q
        if opening is None:
            data.qpos[self._finger_joints] = self._fingers_in_state
        elif self.robot.gripper is not None:
            values = self.robot.gripper.joint_values(opening)
            data.qpos[self._finger_joints] = list(values.values())
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_collision(self._model, data)
        if data.ncon == 0:
            return None
        return self._deepest(frozenset(allowed))

    def depth_in_supports(self, q: ArrayLike, opening: float | None = None) -> dict[str, float]:
        """How deep the object is in what it may touch, by name, margin included [m].

        Supports that it does not touch are left out.

        Args:
            q: the arm's joints, n.
            opening: of the gripper [m]; as in the state by default.
        """
        self.check(q, opening)
        supports = self.scene.object.supports if self.scene.object is not None else frozenset()
        contacts, found = self._data.contact, dict[str, float]()
        for pair, distance in zip(contacts.geom.tolist(), contacts.dist.tolist(), strict=True):
            names = {self._names[geom] for geom in pair}
            for name in names & supports if OBJECT in names else ():
                found[name] = max(found.get(name, -np.inf), -distance)
        return found

    def _deepest(self, allowed: frozenset[Pair]) -> Contact | None:
        contacts = self._data.contact
        geoms, distances = contacts.geom, contacts.dist
        supports = self.scene.object.supports if self.scene.object is not None else ()
        for k in np.argsort(distances).tolist():
            first, second = sorted(geoms[k].tolist(), key=lambda geom: (self._order[geom], -geom))
            names = self._names[first], self._names[second]
            pair = frozenset(names)
            if pair in self._never or pair in allowed:
                continue
            if names[0] == OBJECT and names[1] in supports:
                continue
            kept = self.config.margin if self._order[second] == 2 else 0.0
            return Contact(*names, depth=-float(distances[k]) - kept)
        return None

    def _build(self) -> None:
        self._model = build_collision_model(self.robot, self.scene, self.config.margin)
        place_object(self._model, self.robot, self.scene, self.state)
        self._data = mujoco.MjData(self._model)
        self._data.qpos[:] = self.state.qpos
        self._place_obstacles()
        bodies = body_names(self._model)
        owners = [bodies[body] for body in self._model.geom_bodyid]
        # The robot is named before what it holds, and that before obstacles; outer links first.
        self._order = [
            0 if not name.startswith(PREFIX) else 1 if name == HELD else 2 for name in owners
        ]
        self._names = [
            OBJECT if name in (LYING, HELD) else name.removeprefix(PREFIX) for name in owners
        ]
        address = self._model.jnt_qposadr
        fingers = self.robot.gripper.joints if self.robot.gripper is not None else ()
        self._arm = address[[self._model.joint(name).id for name in self.robot.arm_joints]]
        self._finger_joints = address[np.array([self._model.joint(j).id for j in fingers], int)]
        self._fingers_in_state = self.state.qpos[self._finger_joints]

    def _place_obstacles(self) -> None:
        names, T_base = self._moved
        moved = [box for box in self.scene.obstacles if box.name in names]
        others = [box for box in self.scene.obstacles if box.name not in names]
        place_obstacles(self._model, moved, self._T_world_base * T_base)
        place_obstacles(self._model, others, self._T_world_base)

    def _touching_at_home(self) -> frozenset[Pair]:
        data = mujoco.MjData(self.robot.model)
        data.qpos[:] = self.robot.home.qpos
        mujoco.mj_kinematics(self.robot.model, data)
        mujoco.mj_collision(self.robot.model, data)
        names = body_names(self.robot.model)
        bodies = self.robot.model.geom_bodyid[np.reshape(data.contact.geom, (-1, 2))]
        return frozenset(frozenset((names[a], names[b])) for a, b in bodies.tolist())
