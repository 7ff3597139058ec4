"""Coming to an object that moves: before it, onto the grasp's line, and along that to it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import RigidTransform
from planegrasp.grasping.driving import StoppedError
from planegrasp.robot.motion import plan_path
from planegrasp.robot.path import Path

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.grasping.driving import Drive
    from planegrasp.grasping.executor import ExecutorConfig
    from planegrasp.grasping.interfaces import Arm
    from planegrasp.grasping.nearby import Nearby
    from planegrasp.grasping.plan import GraspPlan
    from planegrasp.grasping.target import MovingTarget
    from planegrasp.robot.kinematics import Kinematics

    Float64Array = NDArray[np.float64]

__all__ = ["Pursuit"]

# Times out of tolerance at which the object has jumped rather than moved.
_JUMPED = 5.0
# Times out of tolerance from which on the fingers may be beside the object: away from it again.
_ASIDE = 2.0
# Times out of tolerance up to which the gripper is before the object, and comes onto its line.
_BEFORE = 10.0


class _InTheWayError(StoppedError):
    """Something that moves would be touched, or nearly: another way may be free."""


class _LeftBehindError(StoppedError):
    """The object was not caught up with."""


class Pursuit:
    """Comes to an object that moves. Any method may raise `StoppedError`.

    Args:
        config: how.
        plan: that was made for where the object was.
        arm: whose clock counts.
        target: says where the object is.
        kinematics: of the arm.
        drive: that drives it.
        nearby: what is around it.
    """

    def __init__(
        self,
        config: ExecutorConfig,
        plan: GraspPlan,
        arm: Arm,
        target: MovingTarget,
        *,
        kinematics: Kinematics,
        drive: Drive,
        nearby: Nearby,
    ) -> None:
        self._config, self._plan, self._arm, self._target = config, plan, arm, target
        self._kinematics, self._drive, self._nearby = kinematics, drive, nearby
        self._deadline = math.inf
        # How far before the grasp the gripper is, on its line [m].
        self._standoff = self._farthest = plan.grasp.pregrasp_distance

    def come_before(self) -> None:
        """Through free space to the pre-grasp.

        Where the object has moved into the way, by another way to where its pre-grasp is by then.
        """
        self._deadline = self._arm.time + self._config.patience
        if not self._follow(self._plan.move) and not self._is_before_object():
            self._go_round("the object moved into the way")

    def reach(self) -> None:
        """Straight to the grasp, to wherever it is by then."""
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

    def stay_with(self) -> None:
        """One period at the grasp, while the fingers close."""
        if self._step() > _JUMPED:
            raise StoppedError("missed", "the object moved away while the fingers closed")

    def leave(self, opening: float) -> None:
        """Back along the grasp's line, wherever an object moves that is still about there.

        Where the arm was in the base, somebody's fingers may be by now. It ends where the arm would
        come nearer to something.

        Args:
            opening: time for fingers that are closed to open [s].
        """
        lost = self._arm.time - self._target.seen > self._config.lost_after
        away = self._config.back_speed * self._config.period
        if self._standoff == 0:
            for _ in range(round(opening / self._config.period)):
                lost = lost or self._lags() > _JUMPED
                self._drive.wait() if lost else self._step()
        while self._standoff < self._farthest and not (lost or self._lags() > _JUMPED):
            self._standoff = min(self._farthest, self._standoff + away)
            T_base_object = self._expected()
            q = self._drive.towards(self._before_grasp(T_base_object))
            if self._comes_nearer(q, T_base_object):
                return
            self._drive.to(q)

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

            self.leave(0.0)
            self._drive.follow(self._drive.back, fastest=config.back_speed, is_free=is_crowded)
            path = self._new_way()
            # The way begins after the time that it takes to find one.
            self._drive.wait(config.thinking)
            if path is not None and (self._follow(path) or self._is_before_object()):
                return

    def _is_before_object(self) -> bool:
        """Whether the gripper is near its pre-grasp, from where it goes on without a plan."""
        return self._drive.missed(self._plan.grasp.pregrasp(self._expected())) <= _BEFORE

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
            if isinstance(path, Path):
                return path
        return None

    def _kept_by_plan(self) -> float:
        """What to keep from things that move on the straight way to the object [m]."""
        self._nearby.place(self._plan.T_base_object)
        return self._nearby.kept(self._plan.reach, reaching=True)

    def _come_nearer(self, kept: float) -> None:
        """From the pre-grasp to the grasp, a little in every period in which it is on its line.

        Farther beside its line it goes back: fingers would push the object, or touch who holds it.
        """
        config = self._config
        self._standoff = self._farthest
        while self._standoff > 0:
            # By where the arm was told to be, and by where it is.
            error = max(self._step(kept), self._lags())
            self._check(self._drive.measured(), self._target.at(self._arm.time), kept, error)
            nearer = config.reach_speed * config.period
            if error < 1:
                self._standoff = max(0.0, self._standoff - nearer)
            elif self._arm.time > self._deadline:
                raise _LeftBehindError(
                    "left behind",
                    f"the object was not caught up with in {config.patience:g} s, the gripper "
                    f"stayed {1000 * self._standoff:.0f} mm away from it",
                )
            elif error > _JUMPED:
                self._standoff = self._farthest
            elif error > _ASIDE:
                self._standoff = min(self._farthest, self._standoff + nearer)
            # In the last part the hand hides the object; beside its line the gripper must see it.
            if self._standoff > config.blind or error >= 1:
                self._check_in_sight()

    def _step(self, kept: float | None = None) -> float:
        """One period towards the distance before the grasp.

        Args:
            kept: from what moves [m]; None where the fingers close or open.

        Returns:
            How far the gripper was told to be beside its line: above 1 it is out of tolerance.
        """
        T_base_object = self._expected()
        goal = self._before_grasp(T_base_object)
        q = self._drive.towards(goal)
        if kept is not None:
            self._check(q, T_base_object, kept, self._drive.missed(goal))
        self._drive.to(q)
        return self._drive.missed(goal)

    def _comes_nearer(self, q: Float64Array, T_base_object: RigidTransform) -> bool:
        """Whether a step leads to where less than the margin is left, and less than here."""
        self._nearby.place(T_base_object)
        there = self._nearby.contact(q, reaching=True)
        here = self._nearby.contact(self._drive.q, reaching=True)
        return there is not None and (here is None or there.depth > here.depth)

    def _lags(self) -> float:
        """How far the gripper is from where it should be at this moment, in tolerances."""
        goal = self._before_grasp(self._target.at(self._arm.time))
        return self._drive.missed(goal, self._drive.measured())

    def _before_grasp(self, T_base_object: RigidTransform) -> RigidTransform:
        """T_base_gripper on the line to the grasp of an object that is there."""
        away = -self._standoff * np.asarray(self._plan.grasp.approach)
        back = RigidTransform.from_translation(away)
        return self._plan.grasp.adapt(T_base_object) * back

    def _check(
        self, q: Float64Array, T_base_object: RigidTransform, kept: float, missed: float
    ) -> None:
        """Stop before something that is in the way; a gripper beside its line, before the object.

        On its line it has the object between its fingers, and needs no margin from it.
        """
        self._nearby.place(T_base_object)
        contact = self._nearby.contact(q, reaching=missed <= 1)
        if contact is None:
            closest = self._nearby.closest(q, reaching=missed <= _JUMPED)
            contact = closest if closest is not None and -closest.depth < kept else None
        if contact is not None:
            raise _InTheWayError("blocked", f"on the way to the object {contact}")

    def _expected(self, later: float = 0.0) -> RigidTransform:
        """T_base_object when the arm has followed the next command, or later [s]."""
        return self._target.at(self._arm.time + self._config.lead + later)

    def _check_in_sight(self) -> None:
        target, config = self._target, self._config
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
