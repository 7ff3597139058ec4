"""Carry out a grasp plan: move there, reach, close, lift; follow an object that moves.

An object that stands still is reached along the planned paths, each point of which was checked. One
that moves is followed (`pursuit`): the planned motion leads to where its pre-grasp was, or another
way does where the object has come into the way; from there the gripper is servoed to where it is by
now, a little nearer in every period. Each step of both is checked for collisions with the object,
and with what moves along with it, where they are by then. Whatever goes wrong, the arm stops, opens
the gripper and goes back the way it came.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.grasping.driving import StoppedError
from planegrasp.grasping.target import MovingTarget
from planegrasp.grasping.way import Way
from planegrasp.pose_filter import PoseFilterConfig
from planegrasp.robot.motion import MotionConfig
from planegrasp.robot.scene import Scene

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from planegrasp.body import BoxBody
    from planegrasp.grasping.interfaces import Arm, Eyes, Sighting
    from planegrasp.grasping.plan import GraspPlan
    from planegrasp.robot.model import Robot

__all__ = ["Execution", "ExecutorConfig", "GraspExecutor"]

# Farther from the plan's start, the first step would be a jump [rad or m].
_AT_START = 0.05

Outcome = Literal["held", "missed", "lost", "left behind", "blocked", "dropped"]


@dataclass(frozen=True, slots=True)
class ExecutorConfig:
    """How a plan is carried out.

    Attributes:
        period: between commands to the arm [s].
        speed: share of the joints' velocity limits, 0 … 1.
        acceleration: of joints [rad/s² or m/s²].
        reach_speed: of the gripper towards the object, beside the object's own [m/s].
        lift_speed: of the gripper upwards [m/s].
        lead: how far ahead of its commands' time the object is aimed at: the arm follows its
            commands that much later [s].
        position_tolerance: the gripper comes nearer while it is within this of its line [m].
        rotation_tolerance: the same for its rotation [rad].
        lost_after: a moving object not seen for this long is lost [s].
        lost_sigma: so is one whose predicted position is more uncertain than this [m].
        margin: kept from obstacles and the object in steps after a moving one [m]; less than what
            was planned with, since its pose differs a little from frame to frame.
        room: from what moves, where there is so much; half of it may be used up by its motion [m].
        lookahead: how long before the arm gets near to what moves it stops [s].
        back_speed: of the gripper on its way back to where there is room [m/s].
        thinking: time that finding another way takes, during which the arm stands still [s].
        paths: search for another way.
        blind: the last part of the way is done without seeing: the hand is in front [m].
        patience: for coming before a moving object, and for catching up with it from there [s].
        closing: longest time to close [s].
        settle: how long the fingers must press before the object is lifted: who holds it has to
            notice, and to let go [s].
        following: a joint farther than this from where it was told to be is blocked [rad or m].
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
    room: float = 0.03
    lookahead: float = 0.2
    back_speed: float = 0.2
    thinking: float = 0.3
    paths: MotionConfig = field(default_factory=MotionConfig)
    blind: float = 0.03
    patience: float = 12.0
    closing: float = 2.0
    settle: float = 0.3
    following: float = 0.15
    motion: PoseFilterConfig = field(default_factory=PoseFilterConfig)

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if isinstance(value, float) and not (math.isfinite(value) and value >= 0):
                raise InvalidInputError(f"{name} must be ≥ 0 and finite, got {value}")
        for name in ("period", "speed", "acceleration", "reach_speed", "lift_speed", "back_speed"):
            if getattr(self, name) == 0:
                raise InvalidInputError(f"{name} must be > 0, got 0")
        if self.speed > 1:
            raise InvalidInputError(f"speed is a share of the limits, 0 … 1, got {self.speed}")


@dataclass(frozen=True, slots=True, eq=False)
class Execution:
    """What came of a plan.

    Attributes:
        outcome: "held" is success. "missed": the fingers closed on nothing; "lost": the object was
            not seen any more; "left behind": it moved away faster than the arm; "blocked":
            something was in the way, or the arm did not follow; "dropped": it fell while it was
            lifted.
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


class GraspExecutor:
    """Carries out plans with one arm.

    Args:
        robot: that the plan is for.
        config: how.

    Raises:
        InvalidInputError: the robot has no gripper.
    """

    def __init__(self, robot: Robot, config: ExecutorConfig | None = None) -> None:
        if robot.gripper is None:
            raise InvalidInputError("a robot without gripper cannot grasp: name its finger_joints")
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
            What came of it. After anything but "held" the arm has gone back the way it came, with
            an open gripper, as far as nothing stopped it there (then the reason says so). If it was
            stopped with the object in its fingers, it stays and holds it.

        Raises:
            InvalidInputError: the arm, or a joint beside it such as a torso, is somewhere else than
                planned, or there are eyes without a sighting.
            RobotError: the arm's clock stands still.
        """
        target = None
        if eyes is not None:
            if sighting is None:
                raise InvalidInputError("a moving object needs the sighting that the plan is from")
            target = MovingTarget(sighting, self.config.motion)
        way = Way(
            self.robot,
            self.config,
            plan,
            arm,
            body,
            scene=scene or Scene(),
            carried=carried,
            eyes=eyes,
            target=target,
        )
        self._check_start(way)
        begun = arm.time
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
        except StoppedError as stop:
            reason = stop.reason
            if arm.is_gripping:
                # Opened in mid-air, the gripper would let the object fall.
                way.stay()
                reason = f"{reason}; the arm stays and holds the object"
                return Execution(stop.outcome, reason, arm.time - begun)
            try:
                way.retreat()
                notify("retreated")
            except StoppedError as again:
                reason = f"{reason}; then, on the way back, {again.reason}"
            return Execution(stop.outcome, reason, arm.time - begun)
        return Execution("held", "", arm.time - begun)

    def _check_start(self, way: Way) -> None:
        distance = way.distance_to_start()
        worst = int(np.argmax(distance))
        if distance[worst] > _AT_START:
            raise InvalidInputError(
                f"the arm must stand where the plan begins: {self.robot.arm_joints[worst]} is "
                f"{distance[worst]:.2f} away from there, at most {_AT_START:g} is right"
            )
        missed = way.misses_grasp_by()
        if missed > self.config.position_tolerance:
            raise InvalidInputError(
                f"with the robot as it stands the plan leads {1000 * missed:.0f} mm beside its "
                f"grasp: joints beside the arm are not where they were when it was planned; give "
                f"the planner the robot's state as `start`"
            )
