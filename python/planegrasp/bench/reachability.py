"""The judge of a grasp experiment: what a PR2's arm can do at the object's true pose.

Exhaustive and independent of the planner: all postures of the arm in closed form (`pr2_arm`), each
checked in the simulated world itself, with its true object and support.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import mujoco
import numpy as np

from planegrasp.bench.pr2_arm import ArmLimits, solutions
from planegrasp.geometry import RigidTransform
from planegrasp.simulation.supports import SUPPORT
from planegrasp.simulation.world_spec import OBJECT

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from planegrasp.grasping.canonical import CanonicalGrasp
    from planegrasp.robot.state import RobotState
    from planegrasp.simulation.world import World

    Float64Array = NDArray[np.float64]

__all__ = ["Judge", "Verdict"]

Verdict = Literal["reachable", "blocked", "unreachable"]

# Of the shoulder's pan [rad], and of the gripper along its lines [m].
_PAN_STEP, _LINE_STEP = 0.02, 0.01
# Postures at neighbouring steps of a line that differ by more are not one motion [rad].
_NEIGHBOURS = 0.25
_GONE = (0.0, 0.0, 100.0)


class Judge:
    """Judges grasps in one world.

    Args:
        world: with a PR2.
        lift: how far up the object has to go [m].
    """

    def __init__(self, world: World, lift: float = 0.1) -> None:
        self._world, self._lift = world, lift
        robot = world.robot
        self._limits = ArmLimits(tuple(robot.soft_lower), tuple(robot.soft_upper))
        self._data = mujoco.MjData(world.model)
        self._arm = [int(world.model.joint(name).qposadr[0]) for name in robot.arm_joints]
        self._object = int(world.model.jnt_qposadr[world.model.body(OBJECT).jntadr[0]])

    def verdict(
        self, grasps: Iterable[CanonicalGrasp], T_base_object: RigidTransform, state: RobotState
    ) -> Verdict:
        """What the arm can do with an object at its true pose.

        "unreachable": no posture within the arm's limits holds it by any grasp. "reachable": some
        posture does, from which the gripper can go straight back to its pre-grasp and straight up
        with the object, without touching anything that it must not. "blocked": what is left.

        Args:
            grasps: canonical.
            T_base_object: the true pose; the support is taken to have moved with it.
            state: of the robot when it planned.
        """
        robot = self._world.robot
        torso = robot.joint(state, "torso_lift")
        self._data.qpos[: len(state.qpos)] = state.qpos
        any_posture = False
        for grasp in grasps:
            if robot.gripper is None or grasp.opening > robot.gripper.max_opening + 1e-9:
                continue
            T = grasp.adapt(T_base_object)
            at_grasp = solutions(T, torso, self._limits, step=_PAN_STEP)
            any_posture |= len(at_grasp) > 0
            if len(at_grasp) and self._can(grasp, T_base_object, at_grasp, torso, state):
                return "reachable"
        return "blocked" if any_posture else "unreachable"

    def _can(
        self,
        grasp: CanonicalGrasp,
        T_base_object: RigidTransform,
        at_grasp: Float64Array,
        torso: float,
        state: RobotState,
    ) -> bool:
        """Whether some posture at the grasp continues back to the pre-grasp and up."""
        fingers = self._world.robot.with_opening(state, grasp.opening)
        self._data.qpos[: len(state.qpos)] = fingers.qpos
        T = grasp.adapt(T_base_object)
        back = -np.asarray(grasp.approach) * grasp.pregrasp_distance
        backwards = [T * RigidTransform.from_translation(share * back) for share in _shares(back)]
        self._put_object(T_base_object)
        closed = self._world.robot.with_opening(state, self._closed(grasp))
        # The fingers must have room to close, and are closed when the object is lifted.
        self._data.qpos[: len(state.qpos)] = closed.qpos
        postures = self._free(at_grasp)
        self._data.qpos[: len(state.qpos)] = fingers.qpos
        postures = self._free(postures)
        postures = self._continued(postures, backwards, torso)
        if not len(postures):
            return False
        self._data.qpos[: len(state.qpos)] = closed.qpos
        up = np.array([0.0, 0.0, self._lift])
        rises = [RigidTransform.from_translation(share * up) for share in _shares(up)]
        objects = [rise * T_base_object for rise in rises]
        return len(self._continued(postures, [rise * T for rise in rises], torso, objects)) > 0

    def _closed(self, grasp: CanonicalGrasp) -> float:
        """Extent of the object along the closing direction [m], for fingers along its sides."""
        y = grasp.T_object_gripper.rotation.as_matrix()[:, 1]
        extent = float(np.abs(y) @ np.array(self._world.object_model.outer_body.size))
        return min(extent, grasp.opening)

    def _continued(
        self,
        postures: Float64Array,
        line: list[RigidTransform],
        torso: float,
        objects: list[RigidTransform] | None = None,
    ) -> Float64Array:
        """Of the postures at the beginning of a line those from which its end is reached."""
        steps = [postures]
        for i, T in enumerate(line):
            if objects is not None:
                self._put_object(objects[i], held_by_support=False)
            there = solutions(T, torso, self._limits, step=_PAN_STEP)
            there = there[_near(there, steps[-1])]
            steps.append(self._free(there))
            if not len(steps[-1]):
                return np.empty((0, 7))
        reaching = steps[-1]
        for before in reversed(steps[:-1]):
            reaching = before[_near(before, reaching)]
        return reaching

    def _free(self, postures: Float64Array) -> Float64Array:
        """Those in which the robot touches nothing but the object between its fingers."""
        return np.array([q for q in postures if self._is_free(q)]).reshape(-1, 7)

    def _is_free(self, q: Float64Array) -> bool:
        data, model = self._data, self._world.model
        data.qpos[self._arm] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        for first, second in data.contact.geom:
            a, b = self._world.groups[first], self._world.groups[second]
            if "robot" in (a, b) or ("fingers" in (a, b) and "object" not in (a, b)):
                return False
        return True

    def _put_object(self, T_base_object: RigidTransform, *, held_by_support: bool = True) -> None:
        world, data = self._world, self._data
        T = world.T_world_base * T_base_object
        x, y, z, w = T.rotation.as_quat()
        data.qpos[self._object : self._object + 7] = [*T.translation, w, x, y, z]
        mocap = int(world.model.body(SUPPORT).mocapid[0])
        if mocap >= 0:
            # A hand that has let go is not in the way any more.
            data.mocap_pos[mocap] = T.translation if held_by_support else _GONE
            data.mocap_quat[mocap] = w, x, y, z


def _shares(way: Float64Array) -> Float64Array:
    """0 … 1 without the 0, in steps of a line."""
    count = max(1, int(np.ceil(np.linalg.norm(way) / _LINE_STEP)))
    return np.linspace(0.0, 1.0, count + 1)[1:]


def _near(postures: Float64Array, others: Float64Array) -> NDArray[np.bool_]:
    """Which postures (N×7) have a neighbour among others (M×7)."""
    if not len(postures) or not len(others):
        return np.zeros(len(postures), dtype=np.bool_)
    difference = postures[:, None] - others[None]
    turned = np.abs((difference + np.pi) % (2 * np.pi) - np.pi)
    # Joints with limits do not turn around.
    turned[..., [0, 1, 2, 3, 5]] = np.abs(difference[..., [0, 1, 2, 3, 5]])
    return np.asarray(turned.max(axis=2).min(axis=1) < _NEIGHBOURS)
