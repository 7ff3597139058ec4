"""An arm driven by the period: along paths, and no farther than it follows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import RobotError
from planegrasp.robot.path import Path
from planegrasp.robot.trajectory import Trajectory, time_parameterise
from planegrasp.robot.wrapping import nearest_turn

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from planegrasp.geometry import RigidTransform
    from planegrasp.grasping.executor import ExecutorConfig, Outcome
    from planegrasp.grasping.interfaces import Arm
    from planegrasp.robot.kinematics import Kinematics
    from planegrasp.robot.model import Robot

    Float64Array = NDArray[np.float64]

__all__ = ["Drive", "StoppedError"]

# Two postures on the way back are the same if no joint differs by more [rad or m].
_SAME = 0.02
# A clock that stands still for so long is broken [s].
_STANDSTILL = 1.0


class StoppedError(Exception):
    """The motion cannot go on."""

    def __init__(self, outcome: Outcome, reason: str) -> None:
        super().__init__(reason)
        self.outcome: Outcome = outcome
        self.reason = reason


class Drive:
    """Drives an arm, and remembers where it has been.

    Args:
        robot: whose arm it is.
        config: period, speeds, and how far behind the arm may be.
        arm: that is driven.
        kinematics: of the robot as it stands.
        start: n, where it was told to be last.
        watch: called after each period.

    Attributes:
        q: where the arm was told to be last, n [rad or m].
    """

    def __init__(
        self,
        robot: Robot,
        config: ExecutorConfig,
        arm: Arm,
        kinematics: Kinematics,
        *,
        start: Float64Array,
        watch: Callable[[], None],
    ) -> None:
        self._robot, self._config, self._arm = robot, config, arm
        self._kinematics, self._watch = kinematics, watch
        self._stood = 0.0
        self.q = start
        self._trail = [self.measured()]

    @property
    def start(self) -> Float64Array:
        """Where the arm was at first, n [rad or m]."""
        return self._trail[0]

    @property
    def back(self) -> Path:
        """The way that it came, from where it was told to be, without detours."""
        return Path(_without_loops(np.array([*self._trail, self.q]))[::-1])

    def stay(self) -> None:
        """Where the arm is, wherever it was told to be."""
        self.q = self.measured()
        self._arm.move(self.q)

    def follow(
        self,
        path: Path,
        *,
        fastest: float = math.inf,
        ahead: float = 0.0,
        is_free: Callable[[Float64Array], bool] = lambda q: True,
    ) -> bool:
        """Along a path, from rest to rest.

        Args:
            path: from where the arm is.
            fastest: of the gripper [m/s].
            ahead: how long before it gets there a posture is asked about [s].
            is_free: where it says no to a posture, n, the path ends.

        Returns:
            Whether it came to the path's end.
        """
        config = self._config
        trajectory = time_parameterise(
            path, self._robot.velocity_limits, config.acceleration, speed=config.speed
        )
        slower = 1.0
        if fastest < math.inf:
            slower = max(1.0, self._gripper_speed(trajectory) / fastest)
        steps = max(1, math.ceil(slower * trajectory.duration / config.period))
        # By counted periods: if the arm's clock leaps, the arm does not leap after it.
        for step in range(1, steps + 1):
            time = step * config.period
            if not is_free(trajectory.sample((time + ahead) / slower)):
                return False
            self.to(trajectory.sample(time / slower))
        return True

    def to(self, q: Float64Array) -> None:
        """Tell the arm where to be after a period, n, and watch that it comes."""
        self._arm.move(q)
        self.q = np.asarray(q, dtype=np.float64)
        self.wait()
        measured = self.measured()
        self._trail.append(measured)
        behind = np.abs(measured - self.q)
        worst = int(np.argmax(behind))
        if behind[worst] > self._config.following:
            raise StoppedError(
                "blocked",
                f"the arm does not follow: {self._robot.arm_joints[worst]} is {behind[worst]:.2f} "
                f"from where it was told to be",
            )

    def towards(self, T_base_gripper: RigidTransform) -> Float64Array:
        """Where the arm, n, gets in a period towards a pose of the gripper."""
        speeds = self._robot.velocity_limits * self._config.speed
        return self._kinematics.step(self.q, T_base_gripper, self._config.period, speeds)

    def missed(self, T_base_gripper: RigidTransform, q: Float64Array | None = None) -> float:
        """How far the gripper is from a pose, in tolerances: 1 is just within them.

        Args:
            T_base_gripper: the pose.
            q: of the arm, n; where it was told to be last where None.
        """
        q = self.q if q is None else q
        missed = self._kinematics.forward(q).inv() * T_base_gripper
        return max(
            float(np.linalg.norm(missed.translation)) / self._config.position_tolerance,
            float(missed.rotation.magnitude()) / self._config.rotation_tolerance,
        )

    def measured(self) -> Float64Array:
        """Where the arm is, n, with continuous joints counted as in what it was told."""
        q = self._robot.arm(self._arm.state)
        return nearest_turn(q, self.q, self._robot.continuous)

    def wait(self, seconds: float = 0.0) -> None:
        """Let a period pass, or as many as there are in some seconds."""
        for _ in range(max(1, round(seconds / self._config.period))):
            before = self._arm.time
            self._arm.advance(self._config.period)
            self._stood = 0.0 if self._arm.time > before else self._stood + self._config.period
            if self._stood > _STANDSTILL:
                raise RobotError(
                    f"the arm's clock stands still at {self._arm.time:g} s: its `advance` must let "
                    f"time pass"
                )
            self._watch()

    def _gripper_speed(self, trajectory: Trajectory) -> float:
        """Largest speed of the gripper along a trajectory [m/s]."""
        times = np.linspace(0.0, trajectory.duration, 2 * len(trajectory.times))
        points = [self._kinematics.forward(q).translation for q in trajectory.sample(times)]
        moved = np.linalg.norm(np.diff(points, axis=0), axis=1)
        return float(moved.max()) / max(float(times[1]), 1e-9)


def _without_loops(trail: Float64Array) -> Float64Array:
    """A trail (m×n) without detours that came back to where it had been."""
    index = len(trail) - 1
    kept = [trail[index]]
    while index > 0:
        same = np.abs(trail[:index] - trail[index]).max(axis=1) < _SAME
        index = int(np.argmax(same)) if same.any() else index - 1
        kept.append(trail[index])
    return np.array(kept[::-1])
