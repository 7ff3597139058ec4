"""The stages of a plan as an arm goes through them, and the way back."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import RobotError
from planegrasp.geometry import RigidTransform
from planegrasp.robot.collision import CollisionChecker, CollisionConfig
from planegrasp.robot.kinematics import Kinematics
from planegrasp.robot.path import Path
from planegrasp.robot.scene import ObjectBody, Scene
from planegrasp.robot.trajectory import Trajectory, time_parameterise
from planegrasp.robot.wrapping import nearest_turn

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from planegrasp.body import BoxBody
    from planegrasp.grasping.executor import ExecutorConfig, Outcome
    from planegrasp.grasping.interfaces import Arm, Eyes
    from planegrasp.grasping.plan import GraspPlan
    from planegrasp.grasping.target import MovingTarget
    from planegrasp.robot.collision import Contact
    from planegrasp.robot.model import Robot

    Float64Array = NDArray[np.float64]

__all__ = ["StoppedError", "Way"]

# Times out of tolerance at which the object has jumped rather than moved.
_JUMPED = 5.0
# Two postures on the way back are the same if no joint differs by more [rad or m].
_SAME = 0.02
# A clock that stands still for so long is broken [s].
_STANDSTILL = 1.0
# After opening the gripper and before moving away from the object [s].
_LETTING_GO = 0.5


class StoppedError(Exception):
    """The motion cannot go on."""

    def __init__(self, outcome: Outcome, reason: str) -> None:
        super().__init__(reason)
        self.outcome: Outcome = outcome
        self.reason = reason


class Way:
    """One plan on its way; see `GraspExecutor.run`. Every stage may raise `StoppedError`."""

    def __init__(
        self,
        robot: Robot,
        config: ExecutorConfig,
        plan: GraspPlan,
        arm: Arm,
        body: BoxBody,
        *,
        scene: Scene,
        carried: Iterable[str],
        eyes: Eyes | None,
        target: MovingTarget | None,
    ) -> None:
        self._config, self._robot = config, robot
        self._plan, self._arm, self._eyes, self._target = plan, arm, eyes, target
        self._body = ObjectBody(body.size, plan.T_base_object, None, body.centre)
        self._kinematics = Kinematics(robot, arm.state)
        self._scene, self._carried = scene, frozenset(carried)
        scene.check_names(self._carried)
        self._checker = self._checks(scene.with_object(self._body))
        self._stood = 0.0
        # Where the arm was told to be last, and where it has been.
        self._q = plan.move.start
        self._trail = [self._measured()]

    def distance_to_start(self) -> Float64Array:
        """How far each joint is from where the plan begins, n [rad or m]."""
        return np.abs(self._trail[0] - self._plan.move.start)

    def misses_grasp_by(self) -> float:
        """How far from the planned grasp the plan's joints bring this arm's gripper [m]."""
        there = self._kinematics.forward(self._plan.reach.end)
        return float(np.linalg.norm(there.translation - self._plan.T_base_gripper.translation))

    def move(self) -> None:
        """Through free space to the pre-grasp, with the gripper open.

        Where an object has moved into the way, `reach` goes on from before it.
        """
        self._arm.grip(self._plan.opening, self._plan.force)
        self._follow(self._plan.move, is_free=self._is_free)

    def reach(self) -> None:
        """Straight to the grasp; to wherever it is by then."""
        if self._target is None:
            self._follow(self._plan.reach, fastest=self._config.reach_speed)
            return
        config = self._config
        farthest = standoff = self._plan.grasp.pregrasp_distance
        deadline = self._arm.time + config.patience
        while standoff > 0:
            error = self._step_after_object(standoff)
            if error < 1:
                standoff = max(0.0, standoff - config.reach_speed * config.period)
            elif self._arm.time > deadline:
                raise StoppedError(
                    "left behind",
                    f"the object was not caught up with in {config.patience:g} s, the gripper "
                    f"stayed {1000 * standoff:.0f} mm away from it",
                )
            elif error > _JUMPED:
                standoff = farthest
            # In the last part the hand hides the object; beside its line the gripper must see it.
            if standoff > config.blind or error >= 1:
                self._check_in_sight()

    def close(self) -> None:
        """Close until the fingers press on the object."""
        config = self._config
        self._arm.grip(0.0, self._plan.force)
        pressed, deadline = 0.0, self._arm.time + config.closing
        eyes = self._eyes
        while pressed < config.settle:
            # What is gripped follows the gripper: seen and followed in turn, both would run away.
            self._eyes = None if self._arm.is_gripping else eyes
            if self._target is None:
                self._wait()
            elif self._step_after_object(0.0, check=False) > _JUMPED:
                raise StoppedError("missed", "the object moved away while the fingers closed")
            pressed = pressed + config.period if self._arm.is_gripping else 0.0
            if pressed < config.settle and self._arm.time > deadline:
                raise StoppedError(
                    "missed", f"the fingers found nothing to press on in {config.closing:g} s"
                )

    def lift(self) -> None:
        """Straight up with the object, which goes where the gripper goes from now on."""
        if self._target is None:
            self._follow(self._plan.lift, fastest=self._config.lift_speed)
        else:
            self._eyes = None
            self._rise()
        if not self._arm.is_gripping:
            raise StoppedError("dropped", "the fingers press on nothing after lifting")

    def retreat(self) -> None:
        """Stop, open the gripper, and go back the way that the arm came."""
        self._eyes = self._target = None
        self.stay()
        self._arm.grip(self._plan.opening, self._plan.force)
        for _ in range(round(_LETTING_GO / self._config.period)):
            self._wait()
        try:
            self._follow(Path(_without_loops(np.array([*self._trail, self._q]))[::-1]))
        except StoppedError:
            self.stay()
            raise

    def _checks(self, scene: Scene) -> CollisionChecker:
        margin = CollisionConfig(margin=self._config.margin)
        return CollisionChecker(self._robot, scene, state=self._arm.state, config=margin)

    def stay(self) -> None:
        """Where the arm is, wherever it was told to be."""
        self._q = self._measured()
        self._arm.move(self._q)

    def _follow(
        self,
        path: Path,
        *,
        fastest: float = math.inf,
        is_free: Callable[[Float64Array], bool] = lambda q: True,
    ) -> None:
        """Along a path, from rest to rest.

        Args:
            path: from where the arm is.
            fastest: of the gripper [m/s].
            is_free: where it says no, the path ends.
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
            q = trajectory.sample(step * config.period / slower)
            if not is_free(q):
                return
            self._drive(q)

    def _gripper_speed(self, trajectory: Trajectory) -> float:
        """Largest speed of the gripper along a trajectory [m/s]."""
        times = np.linspace(0.0, trajectory.duration, 2 * len(trajectory.times))
        points = [self._kinematics.forward(q).translation for q in trajectory.sample(times)]
        moved = np.linalg.norm(np.diff(points, axis=0), axis=1)
        return float(moved.max()) / max(float(times[1]), 1e-9)

    def _step_after_object(self, standoff: float, *, check: bool = True) -> float:
        """One period towards a distance before the grasp.

        Returns:
            How far the gripper's line is missed: above 1 it is out of tolerance.
        """
        config, target = self._config, self._target
        assert target is not None
        T_base_object = target.at(self._arm.time + config.lead)
        back = RigidTransform.from_translation(-standoff * np.asarray(self._plan.grasp.approach))
        goal = self._plan.grasp.adapt(T_base_object) * back
        q = self._kinematics.step(self._q, goal, config.period, self._speeds)
        if check:
            self._check(q, T_base_object, beside=self._missed(goal) > _JUMPED)
        self._drive(q)
        return self._missed(goal)

    def _rise(self) -> None:
        """Up by the height of the plan's lift, from wherever the gripper is."""
        config, lift = self._config, self._plan.lift
        ends = [self._kinematics.forward(q).translation[2] for q in (lift.start, lift.end)]
        height = ends[1] - ends[0]
        # What held it lets go, and goes away.
        left = tuple(o for o in self._scene.obstacles if o.name not in self._carried)
        held = self._body.held(self._plan.grasp.T_object_gripper.inv())
        checker = self._checks(Scene(left, held))
        opening = max(self._robot.opening(self._arm.state), 0.0)
        T = goal = self._kinematics.forward(self._q)
        steps = max(1, math.ceil(height / (config.lift_speed * config.period)))
        for i in range(1, steps + 1):
            goal = RigidTransform.from_translation([0.0, 0.0, height * i / steps]) * T
            q = self._kinematics.step(self._q, goal, config.period, self._speeds)
            contact = checker.check(q, opening, allowed=checker.fingers_on_object)
            if contact is not None:
                raise StoppedError("blocked", f"while it was lifted, {contact}")
            self._drive(q)
        if self._missed(goal) > _JUMPED:
            raise StoppedError("blocked", f"it cannot be lifted by {height:.2f} m from there")

    @property
    def _speeds(self) -> Float64Array:
        return np.asarray(self._robot.velocity_limits * self._config.speed, dtype=np.float64)

    def _missed(self, goal: RigidTransform) -> float:
        """How far the gripper was told to be from a pose, in tolerances."""
        missed = self._kinematics.forward(self._q).inv() * goal
        return max(
            float(np.linalg.norm(missed.translation)) / self._config.position_tolerance,
            float(missed.rotation.magnitude()) / self._config.rotation_tolerance,
        )

    def _check(self, q: Float64Array, T_base_object: RigidTransform, *, beside: bool) -> None:
        """Stop before something that is in the way; a gripper beside its line, before the object.

        On its line it has the object between its fingers, and needs no margin from it.
        """
        contact = self._contact(q, T_base_object, self._checker.fingers_on_object)
        if contact is None and beside:
            contact = self._contact(q, T_base_object)
            contact = contact if contact is not None and contact.depth > 0 else None
        if contact is not None:
            raise StoppedError("blocked", f"on the way to the object {contact}")

    def _is_free(self, q: Float64Array) -> bool:
        """Whether an object that moves is not in the way by now."""
        if self._target is None:
            return True
        return self._contact(q, self._target.at(self._arm.time + self._config.lead)) is None

    def _contact(
        self, q: Float64Array, T_base_object: RigidTransform, allowed: Iterable[frozenset[str]] = ()
    ) -> Contact | None:
        self._checker.set_object(self._body.lying(T_base_object))
        moved = T_base_object * self._plan.T_base_object.inv()
        self._checker.move_obstacles(self._carried, moved)
        return self._checker.check(q, self._plan.opening, allowed=allowed)

    def _check_in_sight(self) -> None:
        target, config = self._target, self._config
        assert target is not None
        unseen = self._arm.time - target.seen
        if unseen > config.lost_after:
            raise StoppedError("lost", f"the object was not seen for {unseen:.1f} s")
        sigma = target.sigma(self._arm.time)
        if sigma > config.lost_sigma:
            raise StoppedError(
                "lost",
                f"the object's position is uncertain by {1000 * sigma:.0f} mm, at most "
                f"{1000 * config.lost_sigma:.0f} mm are accepted",
            )

    def _drive(self, q: Float64Array) -> None:
        """Tell the arm where to be after a period, and watch that it comes."""
        self._arm.move(q)
        self._q = np.asarray(q, dtype=np.float64)
        self._wait()
        measured = self._measured()
        self._trail.append(measured)
        behind = np.abs(measured - self._q)
        worst = int(np.argmax(behind))
        if behind[worst] > self._config.following:
            raise StoppedError(
                "blocked",
                f"the arm does not follow: {self._robot.arm_joints[worst]} is {behind[worst]:.2f} "
                f"from where it was told to be",
            )

    def _measured(self) -> Float64Array:
        """Where the arm is, n, with continuous joints counted as in what it was told."""
        q = self._robot.arm(self._arm.state)
        return nearest_turn(q, self._q, self._robot.continuous)

    def _wait(self) -> None:
        before = self._arm.time
        self._arm.advance(self._config.period)
        self._stood = 0.0 if self._arm.time > before else self._stood + self._config.period
        if self._stood > _STANDSTILL:
            raise RobotError(
                f"the arm's clock stands still at {self._arm.time:g} s: its `advance` must let "
                f"time pass"
            )
        if self._target is not None and self._eyes is not None:
            self._target.update(self._eyes)


def _without_loops(trail: Float64Array) -> Float64Array:
    """A trail (m×n) without detours that came back to where it had been."""
    index = len(trail) - 1
    kept = [trail[index]]
    while index > 0:
        same = np.abs(trail[:index] - trail[index]).max(axis=1) < _SAME
        index = int(np.argmax(same)) if same.any() else index - 1
        kept.append(trail[index])
    return np.array(kept[::-1])
