"""The stages of a plan as an arm goes through them, and the way back."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import RigidTransform
from planegrasp.grasping.driving import Drive, StoppedError
from planegrasp.grasping.nearby import Nearby
from planegrasp.robot.collision import CollisionChecker, CollisionConfig
from planegrasp.robot.kinematics import Kinematics
from planegrasp.robot.motion import plan_path
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
    from planegrasp.robot.path import Path

    Float64Array = NDArray[np.float64]

__all__ = ["Way"]

# Times out of tolerance at which the object has jumped rather than moved.
_JUMPED = 5.0
# Times out of tolerance up to which the gripper is before the object, and comes onto its line.
_BEFORE = 10.0
# Fingers that press for less than this have not let go in between [s].
_FLICKER = 0.05
# After opening the gripper and before moving away from the object [s].
_LETTING_GO = 0.5


class _InTheWayError(StoppedError):
    """Something that moves would be touched, or nearly: another way may be free."""


class _LeftBehindError(StoppedError):
    """The object was not caught up with."""


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
        self._drive = Drive(robot, config, arm, self._kinematics, plan.move.start, self._watch)
        self._nearby = Nearby(
            robot,
            arm.state,
            scene,
            self._body,
            self._carried,
            plan.opening,
            margin=config.margin,
            room=config.room,
        )
        self._deadline = math.inf
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
        """Through free space to the pre-grasp, with the gripper open.

        Where the object has moved into the way, by another way to where its pre-grasp is by then.
        """
        self._arm.grip(self._plan.opening, self._plan.force)
        if self._target is None:
            self._drive.follow(self._plan.move)
            return
        self._deadline = self._arm.time + self._config.patience
        if not self._follow(self._plan.move) and not self._is_before_object():
            self._go_round("the object moved into the way")

    def reach(self) -> None:
        """Straight to the grasp; to wherever it is by then."""
        if self._target is None:
            self._drive.follow(self._plan.reach, fastest=self._config.reach_speed)
            return
        self._deadline = self._arm.time + self._config.patience
        kept = self._kept_by_plan()
        obstacle: _InTheWayError | None = None
        while True:
            try:
                self._come_nearer(kept)
            except _InTheWayError as stop:
                obstacle = stop
                self._go_round(obstacle.reason)
            except _LeftBehindError as stop:
                # What kept it from catching up is the reason.
                raise obstacle or stop from None
            else:
                return

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
            if self._target is None:
                self._drive.wait()
            elif self._step_after_object(0.0) > _JUMPED:
                raise StoppedError("missed", "the object moved away while the fingers closed")
            pressed = pressed + config.period if loose <= _FLICKER else 0.0
            self._top = max(self._top, self._height()) if pressed else -math.inf
            if pressed < config.settle and self._arm.time > deadline:
                raise StoppedError(
                    "missed", f"the fingers found nothing to press on in {config.closing:g} s"
                )

    def lift(self) -> None:
        """Straight up with the object, which goes where the gripper goes from now on."""
        if self._target is None:
            self._drive.follow(self._plan.lift, fastest=self._config.lift_speed)
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
        self._drive.wait(_LETTING_GO)
        try:
            self._drive.follow(self._drive.back)
        except StoppedError:
            self.stay()
            raise

    def stay(self) -> None:
        """Where the arm is, wherever it was told to be."""
        self._drive.stay()

    def _follow(self, path: Path) -> bool:
        """Along a path as long as nothing that moves comes near; whether to its end."""
        config, nearby = self._config, self._nearby
        nearby.place(self._expected())
        kept = nearby.kept(path)

        def is_free(q: Float64Array) -> bool:
            nearby.place(self._expected(config.lookahead))
            return nearby.distance(q) >= kept

        return self._drive.follow(path, ahead=config.lookahead, is_free=is_free)

    def _go_round(self, obstacle: str) -> None:
        """Back until there is room, and by a new way to the pre-grasp.

        Args:
            obstacle: what is in the way, in words.

        Raises:
            StoppedError: no way was found before the patience ended.
        """
        config, nearby = self._config, self._nearby
        while True:
            if self._arm.time > self._deadline:
                raise StoppedError("blocked", obstacle)

            def is_crowded(q: Float64Array) -> bool:
                nearby.place(self._expected())
                return nearby.distance(q) < config.room

            self._drive.follow(self._drive.back, fastest=config.back_speed, is_free=is_crowded)
            path = self._new_way()
            # The way begins after the time that it takes to find one.
            self._drive.wait(config.thinking)
            if path is not None and (self._follow(path) or self._is_before_object()):
                return

    def _is_before_object(self) -> bool:
        """Whether the gripper is near its pre-grasp, from where it goes on without a plan."""
        return self._missed(self._plan.grasp.pregrasp(self._expected())) <= _BEFORE

    def _new_way(self) -> Path | None:
        """From where the arm is to where the pre-grasp will be, in the posture of the plan."""
        T_base_object = self._expected(self._config.thinking)
        self._nearby.place(T_base_object)
        pregrasp = self._plan.grasp.pregrasp(T_base_object)
        goal = self._kinematics.inverse_near(pregrasp, self._plan.move.end)
        if not goal:
            return None
        for checker in (self._nearby.roomy, self._nearby.near):
            path = plan_path(
                checker,
                self._drive.q,
                goal.q,
                opening=self._plan.opening,
                config=self._config.paths,
            )
            if path:
                return path
        return None

    def _kept_by_plan(self) -> float:
        """What to keep from things that move on the straight way to the object [m]."""
        self._nearby.place(self._plan.T_base_object)
        return self._nearby.kept(self._plan.reach, reaching=True)

    def _come_nearer(self, kept: float) -> None:
        """From the pre-grasp to the grasp, a little in every period in which it is on its line."""
        config = self._config
        farthest = standoff = self._plan.grasp.pregrasp_distance
        while standoff > 0:
            error = self._step_after_object(standoff, kept)
            if error < 1:
                standoff = max(0.0, standoff - config.reach_speed * config.period)
            elif self._arm.time > self._deadline:
                raise _LeftBehindError(
                    "left behind",
                    f"the object was not caught up with in {config.patience:g} s, the gripper "
                    f"stayed {1000 * standoff:.0f} mm away from it",
                )
            elif error > _JUMPED:
                standoff = farthest
            # In the last part the hand hides the object; beside its line the gripper must see it.
            if standoff > config.blind or error >= 1:
                self._check_in_sight()

    def _step_after_object(self, standoff: float, kept: float | None = None) -> float:
        """One period towards a distance before the grasp.

        Args:
            standoff: the distance [m].
            kept: from what moves [m]; None where the fingers close.

        Returns:
            How far the gripper's line is missed: above 1 it is out of tolerance.
        """
        T_base_object = self._expected()
        back = RigidTransform.from_translation(-standoff * np.asarray(self._plan.grasp.approach))
        goal = self._plan.grasp.adapt(T_base_object) * back
        q = self._kinematics.step(self._drive.q, goal, self._config.period, self._speeds)
        if kept is not None:
            self._nearby.place(T_base_object)
            self._check(q, kept, self._missed(goal))
        self._drive.to(q)
        return self._missed(goal)

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
            q = self._kinematics.step(self._drive.q, goal, config.period, self._speeds)
            contact = checker.check(q, opening, allowed=checker.fingers_on_object)
            if contact is not None:
                raise StoppedError("blocked", f"while it was lifted, {contact}")
            self._drive.to(q)
        if self._missed(goal) > _JUMPED:
            raise StoppedError("blocked", f"it cannot be lifted by {height:.2f} m from there")

    @property
    def _speeds(self) -> Float64Array:
        return np.asarray(self._robot.velocity_limits * self._config.speed, dtype=np.float64)

    def _height(self) -> float:
        """Of the gripper, in the base [m]."""
        return float(self._kinematics.forward(self._drive.measured()).translation[2])

    def _missed(self, goal: RigidTransform) -> float:
        """How far the gripper was told to be from a pose, in tolerances."""
        missed = self._kinematics.forward(self._drive.q).inv() * goal
        return max(
            float(np.linalg.norm(missed.translation)) / self._config.position_tolerance,
            float(missed.rotation.magnitude()) / self._config.rotation_tolerance,
        )

    def _check(self, q: Float64Array, kept: float, missed: float) -> None:
        """Stop before something that is in the way; a gripper beside its line, before the object.

        On its line it has the object between its fingers, and needs no margin from it.
        """
        contact = self._nearby.contact(q, reaching=missed <= 1)
        if contact is None:
            closest = self._nearby.closest(q, reaching=missed <= _JUMPED)
            contact = closest if closest is not None and -closest.depth < kept else None
        if contact is not None:
            raise _InTheWayError("blocked", f"on the way to the object {contact}")

    def _expected(self, later: float = 0.0) -> RigidTransform:
        """T_base_object when the arm has followed the next command, or later [s]."""
        assert self._target is not None
        return self._target.at(self._arm.time + self._config.lead + later)

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

    def _watch(self) -> None:
        if self._target is not None and self._eyes is not None:
            self._target.update(self._eyes)
