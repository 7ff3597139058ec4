"""The stages of a plan as an arm goes through them, and the way back."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import RigidTransform
from planegrasp.grasping.driving import Drive, StoppedError
from planegrasp.grasping.nearby import Nearby
from planegrasp.grasping.pursuit import Pursuit
from planegrasp.robot.collision import CollisionChecker, CollisionConfig
from planegrasp.robot.kinematics import Kinematics
from planegrasp.robot.scene import ObjectBody, Scene

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from planegrasp.body import BoxBody
    from planegrasp.grasping.executor import ExecutorConfig
    from planegrasp.grasping.interfaces import Arm, Eyes
    from planegrasp.grasping.plan import GraspPlan
    from planegrasp.grasping.target import MovingTarget
    from planegrasp.robot.model import Robot

    Float64Array = NDArray[np.float64]

__all__ = ["Way"]

# Times out of tolerance up to which the gripper has come up.
_LIFTED = 5.0
# Fingers that press for less than this have not let go in between [s].
_FLICKER = 0.05
# After opening the gripper and before moving away from the object [s].
_LETTING_GO = 0.5


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
        kinematics = self._kinematics
        self._drive = drive = Drive(
            robot, config, arm, kinematics, start=plan.move.start, watch=self._watch
        )
        self._pursuit = None
        if target is not None:
            nearby = Nearby(
                robot,
                arm.state,
                scene,
                self._body,
                carried=self._carried,
                opening=plan.opening,
                margin=config.margin,
                room=config.room,
            )
            self._pursuit = Pursuit(
                config, plan, arm, target, kinematics=kinematics, drive=drive, nearby=nearby
            )
        # The highest that the gripper has been since it held the object [m].
        self._top = -math.inf

    def distance_to_start(self) -> Float64Array:
        """How far each joint is from where the plan begins, n [rad or m]."""
        return np.abs(self._drive.start - self._plan.move.start)

    def misses_grasp_by(self) -> float:
        """How far from the planned grasp the plan's joints bring this arm's gripper [m]."""
        there = self._kinematics.forward(self._plan.reach.end)
        return float(np.linalg.norm(there.translation - self._plan.T_base_gripper.translation))

    def move(self) -> None:
        """Through free space to the pre-grasp, with the gripper open; see `Pursuit`."""
        self._arm.grip(self._plan.opening, self._plan.force)
        if self._pursuit is None:
            self._drive.follow(self._plan.move)
        else:
            self._pursuit.come_before()

    def reach(self) -> None:
        """Straight to the grasp; to wherever it is by then."""
        if self._pursuit is None:
            self._drive.follow(self._plan.reach, fastest=self._config.reach_speed)
        else:
            self._pursuit.reach()

    def close(self) -> None:
        """Close until the fingers press on the object."""
        config = self._config
        self._arm.grip(0.0, self._plan.force)
        pressed, loose = 0.0, math.inf
        deadline = self._arm.time + config.closing
        eyes = self._eyes
        while pressed < config.settle:
            loose = 0.0 if self._arm.is_gripping else loose + config.period
            # What is gripped follows the gripper: seen and followed in turn, both would run away.
            self._eyes = None if loose <= _FLICKER else eyes
            if self._pursuit is None:
                self._drive.wait()
            else:
                self._pursuit.stay_with()
            pressed = pressed + config.period if loose <= _FLICKER else 0.0
            self._top = max(self._top, self._height()) if pressed else -math.inf
            if pressed < config.settle and self._arm.time > deadline:
                raise StoppedError(
                    "missed", f"the fingers found nothing to press on in {config.closing:g} s"
                )

    def lift(self) -> None:
        """Straight up with the object, which goes where the gripper goes from now on."""
        if self._pursuit is None:
            self._drive.follow(self._plan.lift, fastest=self._config.lift_speed)
        else:
            # Let go by who held it, it is followed no more.
            self._eyes = self._pursuit = None
            self._rise()
        if not self._arm.is_gripping:
            raise StoppedError("dropped", "the fingers press on nothing after lifting")

    def retreat(self) -> None:
        """Stop, open the gripper, leave the object, and go back the way that the arm came."""
        self.stay()
        self._arm.grip(self._plan.opening, self._plan.force)
        if self._pursuit is None:
            self._drive.wait(_LETTING_GO)
        else:
            try:
                self._pursuit.leave(_LETTING_GO)
            except StoppedError:
                self.stay()
        self._eyes = self._target = None
        try:
            self._drive.follow(self._drive.back)
        except StoppedError:
            self.stay()
            raise

    def stay(self) -> None:
        """Where the arm is, wherever it was told to be."""
        self._drive.stay()

    def _rise(self) -> None:
        """Up by the height of the plan's lift, from the highest that the object was held."""
        config, lift = self._config, self._plan.lift
        ends = [self._kinematics.forward(q).translation[2] for q in (lift.start, lift.end)]
        T = goal = self._kinematics.forward(self._drive.q)
        # It has been moving along until it was let go, down, too.
        height = ends[1] - ends[0] + max(0.0, self._top - T.translation[2])
        # What held it lets go, and goes away.
        left = tuple(o for o in self._scene.obstacles if o.name not in self._carried)
        held = self._body.held(self._plan.grasp.T_object_gripper.inv())
        checker = CollisionChecker(
            self._robot,
            Scene(left, held),
            state=self._arm.state,
            config=CollisionConfig(margin=config.margin),
        )
        opening = max(self._robot.opening(self._arm.state), 0.0)
        steps = max(1, math.ceil(height / (config.lift_speed * config.period)))
        for i in range(1, steps + 1):
            goal = RigidTransform.from_translation([0.0, 0.0, height * i / steps]) * T
            q = self._drive.towards(goal)
            contact = checker.check(q, opening, allowed=checker.fingers_on_object)
            if contact is not None:
                raise StoppedError("blocked", f"while it was lifted, {contact}")
            self._drive.to(q)
        if self._drive.missed(goal) > _LIFTED:
            raise StoppedError("blocked", f"it cannot be lifted by {height:.2f} m from there")

    def _height(self) -> float:
        """Of the gripper, in the base [m]."""
        return float(self._kinematics.forward(self._drive.measured()).translation[2])

    def _watch(self) -> None:
        if self._target is not None and self._eyes is not None:
            self._target.update(self._eyes)
