"""Carry out a grasp plan: move there, reach, close, lift; follow an object that moves.

An object that stands still is reached along the planned paths, each point of which was checked. One
that moves is followed: the planned motion leads to where its pre-grasp was, from there the
gripper is servoed to where the object is by now, a little nearer in every period, each step checked
for collisions. Whatever goes wrong, the arm stops, opens the gripper and retreats.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform
from planegrasp.grasping.target import MovingTarget
from planegrasp.pose_filter import PoseFilterConfig
from planegrasp.robot.collision import CollisionChecker, CollisionConfig
from planegrasp.robot.kinematics import Kinematics
from planegrasp.robot.path import Path
from planegrasp.robot.scene import ObjectBody, Scene
from planegrasp.robot.trajectory import time_parameterise

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from planegrasp.body import BoxBody
    from planegrasp.grasping.interfaces import Arm, Eyes, Sighting
    from planegrasp.grasping.plan import GraspPlan
    from planegrasp.robot.model import Robot

    Float64Array = NDArray[np.float64]

__all__ = ["Execution", "ExecutorConfig", "GraspExecutor"]

Outcome = Literal["held", "missed", "lost", "left behind", "blocked", "dropped"]


@dataclass(frozen=True, slots=True)
class ExecutorConfig:
    """How a plan is carried out.

    Attributes:
        period: between commands to the arm [s].
        speed: share of the joints' velocity limits, 0 … 1.
        acceleration: of joints [rad/s² or m/s²].
        reach_speed: of the gripper towards a moving object, beside the object's own [m/s].
        lift_speed: of the gripper upwards [m/s].
        lead: how far ahead of its commands' time the object is aimed at: the arm follows its
            commands that much later [s].
        position_tolerance: the gripper comes nearer while it is within this of its line [m].
        rotation_tolerance: the same for its rotation [rad].
        lost_after: a moving object not seen for this long is lost [s].
        lost_sigma: so is one whose predicted position is more uncertain than this [m].
        margin: kept from obstacles and the object in steps after a moving one [m]; less than what
            was planned with, since its pose differs a little from frame to frame.
        blind: the last part of the way is done without seeing: the hand is in front [m].
        patience: for catching up with a moving object [s].
        closing: longest time to close [s].
        settle: how long the fingers must press before the object is lifted [s].
        motion: what is assumed of a moving object.
    """

    period: float = 0.02
    speed: float = 0.4
    acceleration: float = 3.0
    reach_speed: float = 0.08
    lift_speed: float = 0.06
    lead: float = 0.04
    position_tolerance: float = 0.006
    rotation_tolerance: float = math.radians(3.0)
    lost_after: float = 0.7
    lost_sigma: float = 0.02
    margin: float = 0.002
    blind: float = 0.03
    patience: float = 12.0
    closing: float = 2.0
    settle: float = 0.3
    motion: PoseFilterConfig = field(default_factory=PoseFilterConfig)

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if isinstance(value, float) and not (math.isfinite(value) and value >= 0):
                raise InvalidInputError(f"{name} must be ≥ 0 and finite, got {value}")
        for name in ("period", "speed", "acceleration", "reach_speed", "lift_speed"):
            if getattr(self, name) == 0:
                raise InvalidInputError(f"{name} must be > 0, got 0")


@dataclass(frozen=True, slots=True, eq=False)
class Execution:
    """What came of a plan.

    Attributes:
        outcome: "held" is success. "missed": the fingers closed on nothing; "lost": the object was
            not seen any more; "left behind": it moved away faster than the arm; "blocked":
            something was in the way; "dropped": it fell while it was lifted.
        reason: in words with figures; "" where held.
        seconds: it took, on the arm's clock.
    """

    outcome: Outcome
    reason: str
    seconds: float

    @property
    def is_held(self) -> bool:
        """Whether the object is in the gripper, lifted."""
        return self.outcome == "held"


class _StoppedError(Exception):
    """The motion cannot go on."""

    def __init__(self, outcome: Outcome, reason: str) -> None:
        super().__init__(reason)
        self.outcome: Outcome = outcome
        self.reason = reason


class GraspExecutor:
    """Carries out plans with one arm.

    Args:
        robot: that the plan is for.
        config: how.
    """

    def __init__(self, robot: Robot, config: ExecutorConfig | None = None) -> None:
        self.robot = robot
        self.config = config or ExecutorConfig()

    def run(
        self,
        plan: GraspPlan,
        arm: Arm,
        body: BoxBody,
        *,
        scene: Scene | None = None,
        carried: Iterable[str] = (),
        eyes: Eyes | None = None,
        sighting: Sighting | None = None,
        notify: Callable[[str], None] | None = None,
    ) -> Execution:
        """Carry out a plan; the arm stands where the plan begins.

        Args:
            plan: for this robot.
            arm: that is driven.
            body: of the object.
            scene: obstacles, for the steps after a moving object.
            carried: names of those that move along with it: the hand that holds it.
            eyes: that see a moving object; None for one that stands still.
            sighting: that the plan was made from; needed with eyes.
            notify: called after each stage with its name: "moved", "reached", "closed", "lifted",
                or "retreated".

        Returns:
            What came of it. After anything but "held" the arm has retreated with an open gripper.
        """
        begun = arm.time
        target = None
        if eyes is not None:
            if sighting is None:
                raise InvalidInputError("a moving object needs the sighting that the plan is from")
            target = MovingTarget(sighting, self.config.motion)
        way = _Way(
            self, plan, arm, body, scene=scene or Scene(), carried=carried, eyes=eyes, target=target
        )
        notify = notify or (lambda stage: None)
        try:
            way.move()
            notify("moved")
            way.reach()
            notify("reached")
            way.close()
            notify("closed")
            way.lift()
            notify("lifted")
        except _StoppedError as stop:
            way.retreat()
            notify("retreated")
            return Execution(stop.outcome, stop.reason, arm.time - begun)
        return Execution("held", "", arm.time - begun)


class _Way:
    """One plan on its way."""

    def __init__(
        self,
        executor: GraspExecutor,
        plan: GraspPlan,
        arm: Arm,
        body: BoxBody,
        *,
        scene: Scene,
        carried: Iterable[str],
        eyes: Eyes | None,
        target: MovingTarget | None,
    ) -> None:
        self._config, self._robot = executor.config, executor.robot
        self._plan, self._arm, self._eyes, self._target = plan, arm, eyes, target
        self._body = ObjectBody(body.size, plan.T_base_object, None, body.centre)
        self._kinematics = Kinematics(self._robot, arm.state)
        self._checker = CollisionChecker(
            self._robot,
            scene.with_object(self._body),
            state=arm.state,
            config=CollisionConfig(margin=self._config.margin),
        )
        self._carried = frozenset(carried)
        scene.check_names(self._carried)
        # Where the arm was told to be last; what the gripper moved along since the free path.
        self._q = self._robot.arm(arm.state)
        self._reached: list[Float64Array] = []

    def move(self) -> None:
        """Through free space to the pre-grasp, with the gripper open."""
        self._arm.grip(self._plan.opening, self._plan.force)
        self._follow(self._plan.move)

    def reach(self) -> None:
        """Straight to the grasp; to wherever it is by then."""
        if self._target is None:
            self._follow(self._plan.reach)
            return
        standoff, deadline = (
            self._plan.grasp.pregrasp_distance,
            self._arm.time + self._config.patience,
        )
        while standoff > 0:
            error = self._step_after_object(standoff)
            if error < 1:
                standoff = max(0.0, standoff - self._config.reach_speed * self._config.period)
            elif self._arm.time > deadline:
                raise _StoppedError(
                    "left behind",
                    f"the object was not caught up with in {self._config.patience:g} s, the "
                    f"gripper stayed {1000 * standoff:.0f} mm away from it",
                )
            if standoff > self._config.blind:
                self._check_in_sight()

    def close(self) -> None:
        """Close until the fingers press on the object."""
        self._arm.grip(0.0, self._plan.force)
        pressed, deadline = 0.0, self._arm.time + self._config.closing
        while pressed < self._config.settle:
            if self._target is None:
                self._wait()
            else:
                self._step_after_object(0.0, check=False)
            pressed = pressed + self._config.period if self._arm.is_gripping else 0.0
            if self._arm.time > deadline:
                raise _StoppedError(
                    "missed", f"the fingers found nothing to press on in {self._config.closing:g} s"
                )

    def lift(self) -> None:
        """Straight up with the object, which goes where the gripper goes from now on."""
        if self._target is None:
            self._follow(self._plan.lift, self._config.lift_speed / 0.4)
        else:
            self._eyes = None
            self._rise()
        if not self._arm.is_gripping:
            raise _StoppedError("dropped", "the fingers press on nothing after lifting")

    def retreat(self) -> None:
        """Open the gripper and go back the way that the arm came."""
        self._arm.move(self._q)
        self._arm.grip(self._robot.gripper.max_opening if self._robot.gripper else 0.0, 20.0)
        for _ in range(round(0.5 / self._config.period)):
            self._wait()
        if self._reached:
            self._follow(Path(np.array([self._q, *self._reached[::-1]])))
        self._follow(Path(np.vstack([self._q, self._plan.move.q[::-1]])))

    def _follow(self, path: Path, speed: float | None = None) -> None:
        """Along a path, from rest to rest."""
        config = self._config
        trajectory = time_parameterise(
            path,
            self._robot.velocity_limits,
            config.acceleration,
            speed=min(speed or config.speed, 1.0),
        )
        begun = self._arm.time
        while self._arm.time - begun < trajectory.duration:
            self._drive(trajectory.sample(self._arm.time - begun + config.period))
        self._drive(trajectory.sample(trajectory.duration))

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
        speeds = self._robot.velocity_limits * config.speed
        q = self._kinematics.step(self._q, goal, config.period, speeds)
        if check:
            self._check(q, T_base_object)
        self._reached.append(self._q)
        self._drive(q)
        missed = self._kinematics.forward(q).inv() * goal
        return max(
            float(np.linalg.norm(missed.translation)) / config.position_tolerance,
            float(missed.rotation.magnitude()) / config.rotation_tolerance,
        )

    def _rise(self) -> None:
        """Up by the height of the plan's lift, from wherever the gripper is."""
        height = (
            self._kinematics.forward(self._plan.lift.end).translation[2]
            - self._kinematics.forward(self._plan.lift.start).translation[2]
        )
        T = self._kinematics.forward(self._q)
        steps = max(1, math.ceil(height / (self._config.lift_speed * self._config.period)))
        for i in range(1, steps + 1):
            goal = RigidTransform.from_translation([0.0, 0.0, height * i / steps]) * T
            self._drive(self._kinematics.step(self._q, goal, self._config.period))

    def _check(self, q: Float64Array, T_base_object: RigidTransform) -> None:
        self._checker.set_object(self._body.lying(T_base_object))
        moved = T_base_object * self._plan.T_base_object.inv()
        self._checker.move_obstacles(self._carried, moved)
        contact = self._checker.check(
            q, self._plan.opening, allowed=self._checker.fingers_on_object
        )
        if contact is not None:
            raise _StoppedError("blocked", f"on the way to the object {contact}")

    def _check_in_sight(self) -> None:
        target, config = self._target, self._config
        assert target is not None
        unseen = self._arm.time - target.seen
        if unseen > config.lost_after:
            raise _StoppedError("lost", f"the object was not seen for {unseen:.1f} s")
        sigma = target.sigma(self._arm.time)
        if sigma > config.lost_sigma:
            raise _StoppedError(
                "lost",
                f"the object's position is uncertain by {1000 * sigma:.0f} mm, at most "
                f"{1000 * config.lost_sigma:.0f} mm are accepted",
            )

    def _drive(self, q: Float64Array) -> None:
        self._arm.move(q)
        self._q = np.asarray(q, dtype=np.float64)
        self._wait()

    def _wait(self) -> None:
        self._arm.advance(self._config.period)
        if self._target is not None and self._eyes is not None:
            self._target.update(self._eyes)
