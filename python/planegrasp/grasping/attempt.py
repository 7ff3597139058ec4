"""One call of the planner: which postures hold the object, and the ways there."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.body import BoxBody
from planegrasp.geometry import RigidTransform
from planegrasp.grasping.clearance import extent_between_fingers
from planegrasp.grasping.company import sidesteps
from planegrasp.grasping.doubts import doubt_between_fingers
from planegrasp.grasping.plan import GraspAssessment
from planegrasp.robot.collision import CollisionChecker, CollisionConfig
from planegrasp.robot.collision_model import body_names
from planegrasp.robot.kinematics import Kinematics
from planegrasp.robot.motion import plan_path, straight_line
from planegrasp.robot.path import MotionFailure, Path
from planegrasp.robot.scene import OBJECT

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.grasping.canonical import CanonicalGrasp
    from planegrasp.grasping.clearance import GripperShape
    from planegrasp.grasping.company import Company
    from planegrasp.grasping.planner import PlannerConfig
    from planegrasp.objects import ObjectModel
    from planegrasp.robot.collision import Contact
    from planegrasp.robot.ik import IKSolution
    from planegrasp.robot.model import Robot
    from planegrasp.robot.scene import Scene
    from planegrasp.robot.state import RobotState

    Float64Array = NDArray[np.float64]

__all__ = ["Attempt", "Candidate", "Judged"]

# What the object rests on is not known better than this [m].
_RESTING = 0.003
# Openings that are checked between open and closed.
_CLOSING = 4
# With less room to a person, a grasp is tried a little aside, too [m].
_CLOSE = 0.03


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A posture that holds the object by one of its grasps."""

    grasp: CanonicalGrasp
    assessment: GraspAssessment
    q: Float64Array


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """The verdict on a grasp, and the postures that do it."""

    verdict: GraspAssessment
    candidates: tuple[Candidate, ...] = ()


class Attempt:
    """What one call of the planner works with: the robot where it stands, in its scene."""

    def __init__(
        self,
        robot: Robot,
        config: PlannerConfig,
        start: RobotState,
        scene: Scene,
        *,
        leaving: frozenset[str] = frozenset(),
        company: Company | None = None,
    ) -> None:
        self._config, self._robot, self._state = config, robot, start
        self._widest = robot.gripper.max_opening if robot.gripper is not None else 0.0
        self._start = robot.arm(start)
        self._kinematics = Kinematics(robot, start, config.inverse)
        self._scene = scene
        self._checker = self._checks(config.close_margin)
        self._lying = scene.object
        scene.check_names(leaving)
        movers = (*body_names(robot.model), OBJECT)
        self._leaving, self._company = leaving, company
        self._in_vain = 0
        self._gone = frozenset(frozenset((mover, name)) for mover in movers for name in leaving)

    def judge(
        self,
        grasp: CanonicalGrasp,
        model: ObjectModel,
        T_base_object: RigidTransform,
        covariance: Float64Array | None,
        *,
        thorough: bool = False,
    ) -> Judged:
        """Can the arm hold the object by this grasp, with what is known of its pose?"""
        figures: dict[str, float] = {}
        doubt, fit = self._doubt(grasp, model.outer_body, covariance, figures)
        if doubt:
            return _refused(grasp, doubt, figures, hopeless=True)
        kinematics = self._kinematics
        if thorough:
            kinematics = Kinematics(self._robot, self._state, self._config.thorough)
        result = kinematics.inverse(grasp.adapt(T_base_object), self._start, seed=self._config.seed)
        figures |= {
            "position_error": result.position_error,
            "rotation_error": result.rotation_error,
        }
        if not result:
            return _refused(grasp, result.reason, figures, hopeless=True)
        reason = ""
        candidates, crowded = [], []
        step, gripper = self._config.sidestep, self._config.gripper
        closed = _closed(grasp, model.outer_body, gripper)
        for solution in result.solutions:
            contact = self._touched_while_closing(solution.q, grasp.opening, closed)
            if contact is not None:
                reason = reason or f"in collision: {contact}"
                if contact.second in self._leaving:
                    crowded.append(solution.q)
                continue
            candidates.append(self._candidate(grasp, solution, fit, figures))
            if candidates[-1].assessment.figures.get("room", math.inf) < _CLOSE:
                crowded.append(solution.q)
        for aside in sidesteps(grasp, model.outer_body, gripper, step):
            candidates += self._aside(
                aside, crowded, T_base_object, closed=closed, fit=fit, figures=figures
            )
        if not candidates:
            return _refused(grasp, reason, figures)
        best = max((c.assessment for c in candidates), key=lambda verdict: verdict.score)
        return Judged(best, tuple(candidates))

    def _checks(self, margin: float) -> CollisionChecker:
        config = CollisionConfig(margin=margin)
        return CollisionChecker(self._robot, self._scene, state=self._state, config=config)

    @cached_property
    def _movers(self) -> tuple[CollisionChecker, ...]:
        """With the room that a fast arm uses up in curves, if there is such a way, and without."""
        margin = self._config.margin
        return tuple(map(self._checks, (max(margin, self._config.wide_margin), margin)))

    def _aside(
        self,
        grasp: CanonicalGrasp,
        crowded: list[Float64Array],
        T_base_object: RigidTransform,
        *,
        closed: float,
        fit: float,
        figures: dict[str, float],
    ) -> list[Candidate]:
        """Of a grasp that was moved aside, postures near those in which there is little room."""
        found = []
        for q in crowded:
            there = self._kinematics.inverse_near(grasp.adapt(T_base_object), q)
            if there and self._touched_while_closing(there.q, grasp.opening, closed) is None:
                moved = {**figures, "aside": self._config.sidestep}
                found.append(self._candidate(grasp, there.solutions[0], fit, moved))
        return found

    def _touched_while_closing(
        self, q: Float64Array, opening: float, closed: float
    ) -> Contact | None:
        """What the fingers, or the rest of the robot, touch besides the object."""
        for gap in np.linspace(opening, closed, _CLOSING):
            contact = self._checker.check(q, gap, allowed=self._checker.fingers_on_object)
            if contact is not None:
                return contact
        return None

    def ways(
        self, candidate: Candidate, T_base_object: RigidTransform
    ) -> tuple[Path, Path, Path] | str:
        """The paths to the pre-grasp, to the grasp and up, or why there are none."""
        grasp, opening, motion = candidate.grasp, candidate.grasp.opening, self._config.motion
        lying = self._lying
        assert lying is not None
        self._checker.set_object(lying)
        back = straight_line(
            self._kinematics,
            self._checker,
            candidate.q,
            grasp.pregrasp(T_base_object),
            opening=opening,
            allowed=self._checker.fingers_on_object,
            config=motion,
        )
        if isinstance(back, MotionFailure):
            return f"no straight way to it: {back.reason}"
        # The open fingers may be near the object, but not go through it.
        contacts = (self._checker.check(q, opening) for q in back.q)
        through = next((found for found in contacts if found is not None and found.depth > 0), None)
        if through is not None:
            return f"no straight way to it: on it, {through}"
        self._checker.set_object(lying.held(grasp.T_object_gripper.inv()))
        closed = _closed(grasp, BoxBody(lying.size, lying.centre), self._config.gripper)
        up = grasp.adapt(T_base_object)
        raised = RigidTransform.from_translation([0.0, 0.0, self._config.lift]) * up
        lift = straight_line(
            self._kinematics,
            self._checker,
            candidate.q,
            raised,
            opening=closed,
            allowed=self._gone | self._checker.fingers_on_object,
            config=motion,
        )
        if isinstance(lift, MotionFailure):
            enough = self._config.least_lift / self._config.lift
            if lift.path is None or lift.fraction < enough:
                return f"it cannot be lifted by {self._config.lift:g} m: {lift.reason}"
            lift = lift.path
        against = self._lifted_into(lift, closed)
        if against:
            return f"it cannot be lifted by {self._config.lift:g} m: object goes into {against}"
        move = self._move(back.end, opening)
        if isinstance(move, MotionFailure):
            return f"no way to its pre-grasp: {move.reason}"
        # Joints without limits may have come to the pre-grasp by other turns than they left it.
        turns = move.end - back.end
        return move, Path(back.reversed().q + turns), Path(lift.q + turns)

    def _move(self, q: Float64Array, opening: float) -> Path | MotionFailure:
        """A free path to a pre-grasp; past what moves with more room where there is any."""
        found: Path | MotionFailure = MotionFailure("")
        seed, motion = self._config.seed, self._config.motion
        for checker in self._movers:
            if self._in_vain >= self._config.searches:
                return MotionFailure(f"{self._in_vain} others were searched for in vain before")
            found = plan_path(checker, self._start, q, opening=opening, seed=seed, config=motion)
            if isinstance(found, Path):
                break
            self._in_vain += found.is_costly
        return found

    def _doubt(
        self,
        grasp: CanonicalGrasp,
        body: BoxBody,
        covariance: Float64Array | None,
        figures: dict[str, float],
    ) -> tuple[str, float]:
        """Why the object would not be between the open fingers, and the probability that it is."""
        too_wide = grasp.why_too_wide(self._widest)
        if too_wide:
            return too_wide, 0.0
        extent = extent_between_fingers(grasp, body, self._config.gripper)
        return doubt_between_fingers(grasp, extent, covariance, self._config.fit, figures)

    def _lifted_into(self, lift: Path, opening: float) -> str:
        """The support that the held object gets deeper into as it rises; "" without."""
        resting = self._checker.depth_in_supports(lift.start, opening)
        for q in lift.q:
            for name, depth in self._checker.depth_in_supports(q, opening).items():
                before = max(resting.get(name, 0.0), self._checker.config.margin)
                if name not in self._leaving and depth > before + _RESTING:
                    return name
        return ""

    def _candidate(
        self, grasp: CanonicalGrasp, solution: IKSolution, fit: float, figures: dict[str, float]
    ) -> Candidate:
        manipulability = self._kinematics.manipulability(solution.q)
        score = _score(solution, manipulability, fit)
        if self._company is not None:
            figures = {**figures, **self._company.figures(solution.q, grasp.opening)}
            score *= self._company.share(figures)
        figures = {
            **figures,
            "limit_margin": solution.limit_margin,
            "manipulability": manipulability,
        }
        assessment = GraspAssessment(grasp.name, True, "", score, figures)
        return Candidate(grasp, assessment, solution.q)


def _score(solution: IKSolution, manipulability: float, fit: float) -> float:
    """0 … 1: far from limits and singularities, near to where the arm is, sure of the object."""
    margin = min(solution.limit_margin / 0.3, 1.0)
    agile = min(manipulability / 0.05, 1.0)
    near = 1.0 - min(solution.distance / (2 * math.pi), 1.0)
    return fit * (0.4 * margin + 0.3 * agile + 0.3 * near)


def _closed(grasp: CanonicalGrasp, body: BoxBody, gripper: GripperShape) -> float:
    """The opening when the fingers, which close symmetrically, have met the object [m]."""
    low, high = extent_between_fingers(grasp, body, gripper)
    return min(max(high - low, 0.0), grasp.opening)


def _refused(
    grasp: CanonicalGrasp, reason: str, figures: dict[str, float], *, hopeless: bool = False
) -> Judged:
    return Judged(GraspAssessment(grasp.name, False, reason, 0.0, dict(figures), hopeless))
