"""Forward and inverse kinematics of a robot's arm.

Inverse kinematics is mink's: each step is a quadratic program that moves the gripper towards its
target within joint limits, and draws redundant joints towards where they started. Whether it ends
in a solution depends on the start, so several are tried.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import mink
import mujoco
import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.robot import frames
from planegrasp.robot.chain import GRIPPER_SITE, arm_chain, longest_reach
from planegrasp.robot.ik import IKConfig, IKResult, IKSolution
from planegrasp.robot.wrapping import nearest_turn, wrapped_difference

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from planegrasp.geometry import RigidTransform
    from planegrasp.robot.model import Robot
    from planegrasp.robot.state import RobotState

    Float64Array = NDArray[np.float64]

_SOLVER = "daqp"
# Against 1 per metre: an arm's own size in metres.
_ORIENTATION_COST = 0.5
# Keeps the quadratic program definite where the arm has more joints than the task needs.
_DAMPING = 1e-8
# Closer than this, redundant joints are left alone, so that only the target counts.
_NEARLY_THERE = 1e-2
# A start that gained less than this factor in so many iterations is given up.
_STAGNATION = (6, 0.8)
# At most, of one start; a joint moves by this at most in each [rad or m].
_ITERATIONS = 30
_LARGEST_STEP = 0.8
# How strongly redundant joints stay where they started.
_POSTURE_COST = 3e-3
# Solutions closer than this in every joint are the same [rad or m].
_DISTINCT = 0.05
# Positions nearer than this count as reached where it is only about why a pose is not [m].
_NOTICEABLE = 0.005
_POSITION_STARTS = 5


class Kinematics:
    """Kinematics of the arm while the robot's other joints stand still.

    Not to be shared between threads: make one for each.

    Args:
        robot: the robot.
        state: where the other joints are; `robot.home` by default.
        config: how inverse kinematics searches.
    """

    def __init__(
        self, robot: Robot, state: RobotState | None = None, config: IKConfig | None = None
    ) -> None:
        self.robot = robot
        self.state = robot.home if state is None else state
        self.config = IKConfig() if config is None else config
        self._chain = arm_chain(robot, self.state)
        self._configuration = mink.Configuration(self._chain)
        self._task = mink.FrameTask(
            GRIPPER_SITE, "site", position_cost=1.0, orientation_cost=_ORIENTATION_COST
        )
        self._posture = mink.PostureTask(self._chain, cost=_POSTURE_COST)
        self._limit = mink.ConfigurationLimit(self._chain, gain=1.0)
        self._reach = longest_reach(self._chain)

    def forward(self, q: ArrayLike) -> RigidTransform:
        """T_base_gripper of the arm at q (n)."""
        data = self._move(q)
        return frames.pose(data.site_xpos[0], data.site_xmat[0])

    def jacobian(self, q: ArrayLike) -> Float64Array:
        """Velocity of the gripper frame's origin and its angular velocity per joint velocity.

        Returns:
            6×n, translation before rotation, in the base frame.
        """
        data = self._move(q)
        J = np.zeros((6, self.robot.n))
        mujoco.mj_jacSite(self._chain, data, J[:3], J[3:], 0)
        return J

    def manipulability(self, q: ArrayLike) -> float:
        """Yoshikawa's measure √det(J·Jᵀ) (1985): 0 at a singularity."""
        return float(np.prod(np.linalg.svd(self.jacobian(q), compute_uv=False)))

    def limit_margin(self, q: ArrayLike) -> float:
        """How far the joint closest to a soft limit is from it: 1 mid-range, 0 at it, < 0 beyond.

        Continuous joints do not count.
        """
        values = self._checked(q)
        low, high = self.robot.soft_lower, self.robot.soft_upper
        bounded = ~self.robot.continuous
        room = np.minimum(values - low, high - values)[bounded]
        return float((room / ((high - low)[bounded] / 2)).min(initial=1.0))

    def inverse(
        self, T_base_gripper: RigidTransform, start: ArrayLike | None = None, *, seed: int = 0
    ) -> IKResult:
        """Joint positions within the soft limits that bring the gripper frame to a pose.

        Args:
            T_base_gripper: the target.
            start: tried first, and solutions near it are preferred, n; by default the state's.
            seed: of the random further starts.
        """
        first = self._checked(self.robot.arm(self.state) if start is None else start)
        beyond = self._beyond_reach(T_base_gripper)
        if beyond > 0:
            position_error, rotation_error = self._errors(first, T_base_gripper)
            reason = f"unreachable: at least {beyond:.2f} m outside the workspace"
            return IKResult((), first, position_error, rotation_error, reason)
        config = self.config
        rng = np.random.default_rng(seed)
        found: list[IKSolution] = []
        closest, closest_cost = first, np.inf
        for attempt in range(config.hopeless_starts):
            if len(found) >= config.solutions or (found and attempt >= config.starts):
                break
            begin = first if attempt == 0 else self._random(rng)
            q, cost = self._descend(T_base_gripper, begin)
            if cost < closest_cost:
                closest, closest_cost = q, cost
            solution = self._solution(q, T_base_gripper, first)
            if solution is not None and not self._known(solution, found):
                found.append(solution)
        if not found:
            errors = self._errors(closest, T_base_gripper)
            return IKResult((), closest, *errors, self._reason(closest, T_base_gripper))
        found.sort(key=lambda solution: solution.distance)
        best = found[0]
        return IKResult(tuple(found), best.q, best.position_error, best.rotation_error)

    def inverse_near(self, T_base_gripper: RigidTransform, start: ArrayLike) -> IKResult:
        """The solution that descends from one start, to follow a line without changing branch."""
        first = self._checked(start)
        q, _ = self._descend(T_base_gripper, first)
        solution = self._solution(q, T_base_gripper, first)
        if solution is None:
            near = nearest_turn(q, first, self.robot.continuous)
            errors = self._errors(q, T_base_gripper)
            return IKResult((), near, *errors, self._reason(q, T_base_gripper))
        errors = solution.position_error, solution.rotation_error
        return IKResult((solution,), solution.q, *errors)

    def step(
        self,
        q: ArrayLike,
        T_base_gripper: RigidTransform,
        dt: float,
        velocity_limits: ArrayLike | None = None,
    ) -> Float64Array:
        """Move towards a target, which may itself move, for one period of a controller.

        Args:
            q: where the arm is, n.
            T_base_gripper: the target.
            dt: the period [s].
            velocity_limits: n [rad/s or m/s]; the robot's by default.

        Returns:
            Where the arm shall be after dt, n; within soft limits and velocity limits.
        """
        before = self._checked(q)
        if not (np.isfinite(dt) and dt > 0):
            raise InvalidInputError(f"the period dt must be > 0 s, got {dt}")
        limits = self.robot.velocity_limits if velocity_limits is None else velocity_limits
        speeds = self._checked(limits)
        self._configuration.update(before)
        self._task.set_target(_se3(T_base_gripper))
        self._posture.set_target(before)
        # Coming from outside of the soft limits, every step inwards is within these.
        limit = mink.ConfigurationLimit(self._chain, gain=1.0)
        limit.lower = np.minimum(limit.lower, before)
        limit.upper = np.maximum(limit.upper, before)
        velocity = mink.VelocityLimit(
            self._chain, dict(zip(self.robot.arm_joints, speeds.tolist(), strict=True))
        )
        v = mink.solve_ik(
            self._configuration,
            [self._task, self._posture],
            dt,
            _SOLVER,
            damping=_DAMPING,
            limits=[limit, velocity],
        )
        return np.asarray(before + np.clip(v, -speeds, speeds) * dt, dtype=np.float64)

    def _descend(self, target: RigidTransform, start: Float64Array) -> tuple[Float64Array, float]:
        """Follow mink's steps from a start until they arrive or get stuck.

        Returns:
            The joints, n, and the remaining cost.
        """
        configuration, task = self._configuration, self._task
        inside = np.clip(start, self.robot.soft_lower, self.robot.soft_upper)
        configuration.update(inside)
        task.set_target(_se3(target))
        self._posture.set_target(inside)
        patience, gain = _STAGNATION
        history: list[float] = []
        for _ in range(_ITERATIONS):
            error = task.compute_error(configuration)
            position, rotation = (float(np.linalg.norm(part)) for part in (error[:3], error[3:]))
            history.append(float(np.hypot(position, _ORIENTATION_COST * rotation)))
            if self._is_there(position, rotation):
                break
            if len(history) > patience and history[-1] > gain * history[-1 - patience]:
                break
            tasks = [task] if history[-1] < _NEARLY_THERE else [task, self._posture]
            v = mink.solve_ik(
                configuration, tasks, 1.0, _SOLVER, damping=_DAMPING, limits=[self._limit]
            )
            v *= min(1.0, _LARGEST_STEP / max(float(np.abs(v).max()), 1e-12))
            configuration.integrate_inplace(v, 1.0)
        q = np.clip(configuration.q, self.robot.soft_lower, self.robot.soft_upper)
        return q, history[-1]

    def _is_there(self, position_error: float, rotation_error: float) -> bool:
        """Whether it is so near that the solution is exact enough beyond doubt."""
        arrived = position_error < self.config.position_tolerance / 2
        turned = rotation_error < self.config.rotation_tolerance / 2
        return arrived and (turned or not self._task.cost[3:].any())

    def _solution(
        self, q: Float64Array, target: RigidTransform, start: Float64Array
    ) -> IKSolution | None:
        position_error, rotation_error = self._errors(q, target)
        if position_error > self.config.position_tolerance:
            return None
        if rotation_error > self.config.rotation_tolerance:
            return None
        near = nearest_turn(q, start, self.robot.continuous)
        distance = float(np.abs(near - start).max())
        return IKSolution(near, position_error, rotation_error, self.limit_margin(near), distance)

    def _known(self, solution: IKSolution, found: list[IKSolution]) -> bool:
        continuous = self.robot.continuous
        return any(
            np.abs(wrapped_difference(solution.q, other.q, continuous)).max() < _DISTINCT
            for other in found
        )

    def _errors(self, q: Float64Array, target: RigidTransform) -> tuple[float, float]:
        # Thousands of times a plan: in plain arrays, a fraction of what transforms cost.
        data = self._move(q)
        shift = target.translation - data.site_xpos[0]
        turn = data.site_xmat[0].reshape(3, 3).T @ target.rotation.as_matrix()
        sine = np.linalg.norm(turn[[2, 0, 1], [1, 2, 0]] - turn[[1, 2, 0], [2, 0, 1]])
        angle = np.arctan2(sine, np.trace(turn) - 1.0)
        return float(np.linalg.norm(shift)), float(angle)

    def _random(self, rng: np.random.Generator) -> Float64Array:
        low = np.where(self.robot.continuous, -np.pi, self.robot.soft_lower)
        high = np.where(self.robot.continuous, np.pi, self.robot.soft_upper)
        return rng.uniform(low, high)

    def _beyond_reach(self, target: RigidTransform) -> float:
        shoulder = self._configuration.data.xanchor[0]
        return float(np.linalg.norm(target.translation - shoulder)) - self._reach

    def _reason(self, closest: Float64Array, target: RigidTransform) -> str:
        """Why the target cannot be reached, judged from the closest that could."""
        missing = self._missing(closest, target)
        if missing > _NOTICEABLE:
            return f"unreachable: {missing:.2f} m outside the workspace"
        position_error, rotation_error = self._errors(closest, target)
        text = (
            f"unreachable in this orientation: {np.degrees(rotation_error):.1f}° and "
            f"{1000 * position_error:.1f} mm off at best"
        )
        low, high = self.robot.soft_lower, self.robot.soft_upper
        at_limit = [
            name
            for name, value, a, b in zip(self.robot.arm_joints, closest, low, high, strict=True)
            if min(value - a, b - value) < 1e-3
        ]
        if not at_limit:
            return text
        limit = "its limit" if len(at_limit) == 1 else "their limits"
        return f"{text}, with {' and '.join(at_limit)} at {limit}"

    def _missing(self, closest: Float64Array, target: RigidTransform) -> float:
        """How far from the target the gripper stays in any orientation [m]."""
        rng = np.random.default_rng(0)
        missing = np.inf
        self._task.set_orientation_cost(0.0)
        try:
            for attempt in range(_POSITION_STARTS):
                start = closest if attempt == 0 else self._random(rng)
                q, _ = self._descend(target, start)
                missing = min(missing, self._errors(q, target)[0])
                if missing < _NOTICEABLE:
                    break
        finally:
            self._task.set_orientation_cost(_ORIENTATION_COST)
        return missing

    def _move(self, q: ArrayLike) -> mujoco.MjData:
        self._configuration.update(self._checked(q))
        return self._configuration.data

    def _checked(self, q: ArrayLike) -> Float64Array:
        values = np.array(q, dtype=np.float64)
        if values.shape != (self.robot.n,) or not np.all(np.isfinite(values)):
            raise InvalidInputError(
                f"the arm has {self.robot.n} joints ({', '.join(self.robot.arm_joints)}): expected "
                f"as many finite values, got {values.tolist()}"
            )
        return values


def _se3(transform: RigidTransform) -> mink.SE3:
    quaternion = transform.rotation.as_quat(scalar_first=True)
    return mink.SE3(np.concatenate([quaternion, transform.translation]))
