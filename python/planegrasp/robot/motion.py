"""Collision-free paths of the arm: anywhere through joint space, or straight in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.robot.path import MotionFailure, Path, densify, round_corners
from planegrasp.robot.rrt import find_waypoints
from planegrasp.robot.wrapping import nearest_turn

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike, NDArray

    from planegrasp.robot.collision import CollisionChecker
    from planegrasp.robot.kinematics import Kinematics

    Float64Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MotionConfig:
    """How paths are made.

    Attributes:
        step: largest change of a joint between two points of a path, each of which is checked
            [rad or m].
        time_limit: for finding a path through joint space [s]. Whoever needs the same answer on
            every machine must make it so long that it is never reached.
        most_checks: postures that are checked for one path before it is given up; the same on every
            machine.
        attempts: paths that are looked for, with different random numbers; the shortest is taken.
            Where two of them found none, there is hardly one.
        rounding: passes of averaging that round corners.
        line_step: of the gripper along a straight line [m].
        turn_step: of the gripper's rotation along it [rad].
        largest_jump: of a joint in one such step; more is another branch of solutions [rad or m].
    """

    step: float = 0.02
    time_limit: float = 3.0
    most_checks: int = 3_000
    attempts: int = 3
    rounding: int = 60
    line_step: float = 0.005
    turn_step: float = 0.02
    largest_jump: float = 0.2

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if name != "rounding" and not getattr(self, name) > 0:
                raise InvalidInputError(f"{name} must be > 0, got {getattr(self, name)}")


def plan_path(
    checker: CollisionChecker,
    q_start: ArrayLike,
    q_goal: ArrayLike,
    *,
    opening: float | None = None,
    allowed: Iterable[frozenset[str]] = (),
    seed: int = 0,
    config: MotionConfig | None = None,
) -> Path | MotionFailure:
    """A collision-free path through joint space, within the robot's soft limits.

    RRT-Connect (Kuffner and LaValle, 2000) by OMPL, shortened, with rounded corners. The same seed
    gives the same path.

    Args:
        checker: the robot and what is around it.
        q_start: n.
        q_goal: n; continuous joints turn the short way there.
        opening: of the gripper on the way [m]; as in the checker's state by default.
        allowed: pairs that may touch, see `CollisionChecker.check`.
        seed: ≥ 0.
        config: how.
    """
    config = MotionConfig() if config is None else config
    robot = checker.robot
    start = _vector(q_start, robot.n, "q_start")
    goal = nearest_turn(_vector(q_goal, robot.n, "q_goal"), start, robot.continuous)
    pairs = frozenset(allowed)
    for name, q in (("the start", start), ("the goal", goal)):
        contact = checker.check(q, opening, allowed=pairs)
        if contact is not None:
            return MotionFailure(f"at {name}, {contact}")

    def is_free(points: Float64Array) -> bool:
        return all(checker.check(q, opening, allowed=pairs) is None for q in points)

    direct = densify(np.vstack([start, goal]), config.step)
    if is_free(direct):
        return Path(direct)
    outside = _outside(checker, start, goal)
    if outside:
        return MotionFailure(outside)
    waypoints = find_waypoints(
        lambda q: checker.check(q, opening, allowed=pairs) is None,
        start,
        goal,
        lower=np.where(robot.continuous, np.minimum(start, goal) - np.pi, robot.soft_lower),
        upper=np.where(robot.continuous, np.maximum(start, goal) + np.pi, robot.soft_upper),
        resolution=config.step,
        time_limit=config.time_limit,
        most_checks=config.most_checks,
        attempts=config.attempts,
        seed=seed,
    )
    if waypoints is None:
        return MotionFailure(
            f"no path found within {config.time_limit:g} s and {config.most_checks} postures each",
            is_costly=True,
        )
    dense = densify(waypoints, config.step)
    if not is_free(dense):
        return MotionFailure("the path that was found grazes something; another seed may help")
    return Path(round_corners(dense, config.rounding, is_free))


def straight_line(
    kinematics: Kinematics,
    checker: CollisionChecker,
    q_start: ArrayLike,
    T_base_gripper: RigidTransform,
    *,
    opening: float | None = None,
    allowed: Iterable[frozenset[str]] = (),
    config: MotionConfig | None = None,
) -> Path | MotionFailure:
    """Move the gripper on a straight line to a pose, turning evenly, without leaving its branch.

    Args:
        kinematics: of the checker's robot and state.
        checker: the robot and what is around it.
        q_start: where the line begins, n.
        T_base_gripper: where it ends.
        opening: of the gripper on the way [m]; as in the checker's state by default.
        allowed: pairs that may touch, see `CollisionChecker.check`.
        config: how finely.
    """
    config = MotionConfig() if config is None else config
    pairs = frozenset(allowed)
    q = _vector(q_start, checker.robot.n, "q_start")
    contact = checker.check(q, opening, allowed=pairs)
    if contact is not None:
        return MotionFailure(f"at the start, {contact}")
    poses = _line(kinematics.forward(q), T_base_gripper, config)
    done = [q[None]]
    for index, T in enumerate(poses):
        share = index / len(poses)
        result = kinematics.inverse_near(T, q)
        reason = result.reason
        if result and np.abs(result.q - q).max() > config.largest_jump:
            joint = checker.robot.arm_joints[int(np.argmax(np.abs(result.q - q)))]
            reason = f"{joint} would have to jump"
        if not reason:
            piece = densify(np.vstack([q, result.q]), config.step)[1:]
            contacts = (checker.check(point, opening, allowed=pairs) for point in piece)
            contact = next((found for found in contacts if found is not None), None)
            reason = "" if contact is None else str(contact)
        if reason:
            text = f"{100 * share:.0f} % along the line, {reason}"
            return MotionFailure(text, share, Path(np.vstack(done)))
        done.append(piece)
        q = result.q
    return Path(np.vstack(done))


def _line(
    T_base_from: RigidTransform, T_base_to: RigidTransform, config: MotionConfig
) -> list[RigidTransform]:
    """Poses on the way, without the first."""
    shift = T_base_to.translation - T_base_from.translation
    turn = (T_base_to.rotation * T_base_from.rotation.inv()).as_rotvec()
    shifts = float(np.linalg.norm(shift)) / config.line_step
    turns = float(np.linalg.norm(turn)) / config.turn_step
    steps = max(shifts, turns, 1.0)
    shares = np.linspace(0.0, 1.0, int(np.ceil(steps - 1e-9)) + 1)[1:, None]
    poses = RigidTransform.from_components(
        T_base_from.translation + shares * shift,
        Rotation.from_rotvec(shares * turn) * T_base_from.rotation,
    )
    return list(poses)


def _outside(checker: CollisionChecker, start: Float64Array, goal: Float64Array) -> str:
    """Which joint of start or goal is outside of the soft limits, or an empty text."""
    robot = checker.robot
    for name, q in (("start", start), ("goal", goal)):
        beyond = np.maximum(robot.soft_lower - q, q - robot.soft_upper)
        worst = int(np.argmax(beyond))
        if beyond[worst] > 1e-9:
            return (
                f"at the {name}, {robot.arm_joints[worst]} is {beyond[worst]:.3f} outside of its "
                f"limits for planning"
            )
    return ""


def _vector(q: ArrayLike, n: int, what: str) -> Float64Array:
    values = np.array(q, dtype=np.float64)
    if values.shape != (n,) or not np.all(np.isfinite(values)):
        raise InvalidInputError(f"{what} must be {n} finite joint positions, got {values.tolist()}")
    return values
