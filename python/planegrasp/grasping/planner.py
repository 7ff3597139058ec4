"""From a detection to a motion of the arm: which of the taught grasps, and how to get there.

1. adapt every canonical grasp to where the object is (paper, eq. 11);
2. judge each: reach, limits, collisions, and how well the object's pose is known;
3. of the best that also has a way there: straight to the object, up with it, and a free path to
   where the straight line begins.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, checked_transform
from planegrasp.grasping.canonical import check_unique
from planegrasp.grasping.clearance import GripperShape, extent_between_fingers
from planegrasp.grasping.doubts import closing_sigma, doubt
from planegrasp.grasping.plan import GraspAssessment, GraspPlan, GraspRefusal
from planegrasp.robot.collision import CollisionChecker
from planegrasp.robot.collision_model import body_names
from planegrasp.robot.ik import IKConfig
from planegrasp.robot.kinematics import Kinematics
from planegrasp.robot.motion import MotionConfig, plan_path, straight_line
from planegrasp.robot.path import MotionFailure
from planegrasp.robot.scene import OBJECT, ObjectBody, Scene

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from planegrasp.detection import Detection
    from planegrasp.grasping.canonical import CanonicalGrasp
    from planegrasp.objects import ObjectModel
    from planegrasp.robot.ik import IKSolution
    from planegrasp.robot.model import Robot
    from planegrasp.robot.path import Path
    from planegrasp.robot.state import RobotState

    Float64Array = NDArray[np.float64]

__all__ = ["GraspPlanner", "PlannerConfig"]


# What the object rests on is not known better than this [m].
_RESTING = 0.003


@dataclass(frozen=True, slots=True)
class PlannerConfig:
    """What a grasp must fulfil, and how much is tried.

    Attributes:
        translation_sigma: largest standard deviation of the object's position [m].
        rotation_sigma: largest standard deviation of its rotation [rad].
        need_depth: refuse poses that no depth took part in.
        fit: least probability that the object lies between the open fingers.
        lift: how far up the object is taken [m].
        solutions: postures of the arm that are tried for one grasp.
        gripper: shape of fingers and palm, for the width of the object between them.
        inverse: search for postures.
        motion: search for paths.
        seed: of all that is random.
    """

    translation_sigma: float = 0.02
    rotation_sigma: float = math.radians(3.0)
    need_depth: bool = True
    fit: float = 0.7
    lift: float = 0.12
    solutions: int = 4
    gripper: GripperShape = field(default_factory=GripperShape)
    inverse: IKConfig = field(default_factory=IKConfig)
    motion: MotionConfig = field(default_factory=MotionConfig)
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("translation_sigma", "rotation_sigma", "lift", "solutions"):
            if not getattr(self, name) > 0:
                raise InvalidInputError(f"{name} must be > 0, got {getattr(self, name)}")
        if self.seed < 0:
            raise InvalidInputError(f"a seed must be ≥ 0, got {self.seed}")
        if not 0 <= self.fit < 1:
            raise InvalidInputError(f"fit is a probability below 1, got {self.fit}")


@dataclass(frozen=True, slots=True, eq=False)
class _Candidate:
    """A posture that holds the object by one of its grasps."""

    grasp: CanonicalGrasp
    assessment: GraspAssessment
    q: Float64Array


class GraspPlanner:
    """Plans for one robot. Not to be shared between threads.

    Args:
        robot: with a gripper.
        config: what a grasp must fulfil.

    Raises:
        InvalidInputError: the robot has no gripper.
    """

    def __init__(self, robot: Robot, config: PlannerConfig | None = None) -> None:
        if robot.gripper is None:
            raise InvalidInputError("a robot without gripper cannot grasp: name its finger_joints")
        self.robot = robot
        self.config = config or PlannerConfig()
        self._widest = robot.gripper.max_opening

    def plan(
        self,
        detection: Detection,
        T_base_camera: RigidTransform | ArrayLike,
        *,
        scene: Scene | None = None,
        start: RobotState | None = None,
        supports: Iterable[str] = (),
        leaving: Iterable[str] = (),
    ) -> GraspPlan | GraspRefusal:
        """Plan to grasp a detected object.

        Args:
            detection: with the object's model and pose.
            T_base_camera: pose of the camera's optical frame in the robot's base, when the frame
                was taken.
            scene: obstacles; none where None. The object itself is added.
            start: where the robot's joints are; at home where None.
            supports: names of obstacles that the object stands on or hangs from.
            leaving: names of obstacles that go away once the object is gripped: a hand.

        Returns:
            A plan, or a refusal with a reason for each grasp.

        Raises:
            GraspError: the object has two grasps of one name.
            InvalidInputError: T_base_camera is no finite rigid transform, or `supports` or
                `leaving` name what the scene does not have.
        """
        config = self.config
        T_base_camera = checked_transform(T_base_camera, "T_base_camera")
        uncertain = doubt(
            detection,
            config.translation_sigma,
            config.rotation_sigma,
            need_depth=config.need_depth,
        )
        if uncertain or detection.T_camera_object is None:
            assessments = (
                GraspAssessment(g.name, False, uncertain) for g in detection.model.grasps
            )
            return GraspRefusal(detection.name, uncertain, tuple(assessments))
        return self.plan_at(
            detection.model,
            T_base_camera * detection.T_camera_object,
            covariance=detection.covariance,
            scene=scene,
            start=start,
            supports=supports,
            leaving=leaving,
        )

    def plan_at(
        self,
        model: ObjectModel,
        T_base_object: RigidTransform | ArrayLike,
        *,
        covariance: Float64Array | None = None,
        scene: Scene | None = None,
        start: RobotState | None = None,
        supports: Iterable[str] = (),
        leaving: Iterable[str] = (),
    ) -> GraspPlan | GraspRefusal:
        """Plan to grasp an object whose pose is known; see `plan` for the other arguments.

        Args:
            model: with its grasps.
            T_base_object: where it is.
            covariance: 6×6 of (translation, rotation vector) in the object's frame; None is exact.
            scene: see `plan`.
            start: see `plan`.
            supports: see `plan`.
            leaving: see `plan`.
        """
        T_base_object = checked_transform(T_base_object, "T_base_object")
        check_unique(model.grasps, model.name)
        if not model.grasps:
            return GraspRefusal(
                model.name, "no grasp is taught: show one (`planegrasp grasp teach`)"
            )
        begun = time.perf_counter()
        body = model.outer_body
        lying = ObjectBody(body.size, T_base_object, None, body.centre, frozenset(supports))
        attempt = _Attempt(
            self.robot,
            self.config,
            self.robot.home if start is None else start,
            (scene or Scene()).with_object(lying),
            frozenset(leaving),
        )
        judged = [
            attempt.judge(grasp, model, T_base_object, covariance, self._widest)
            for grasp in model.grasps
        ]
        seconds = {"selection": time.perf_counter() - begun}
        verdicts = {g.name: j.verdict for g, j in zip(model.grasps, judged, strict=True)}
        candidates = [candidate for j in judged for candidate in j.candidates]
        for candidate in sorted(candidates, key=lambda c: -c.assessment.score):
            ways = attempt.ways(candidate, T_base_object)
            if isinstance(ways, str):
                # What the best posture fails by is the reason, not what the others fail by.
                if verdicts[candidate.grasp.name].accepted:
                    verdicts[candidate.grasp.name] = replace(
                        candidate.assessment, accepted=False, reason=ways, score=0.0
                    )
                continue
            seconds["motion"] = time.perf_counter() - begun - seconds["selection"]
            verdicts[candidate.grasp.name] = candidate.assessment
            move, reach, lift = ways
            return GraspPlan(
                name=model.name,
                grasp=candidate.grasp,
                T_base_object=T_base_object,
                T_base_gripper=candidate.grasp.adapt(T_base_object),
                T_base_pregrasp=candidate.grasp.pregrasp(T_base_object),
                move=move,
                reach=reach,
                lift=lift,
                opening=candidate.grasp.opening,
                force=candidate.grasp.force,
                assessments=_chosen_first(verdicts, candidate.grasp.name),
                seconds=seconds,
            )
        seconds["motion"] = time.perf_counter() - begun - seconds["selection"]
        return GraspRefusal(
            model.name,
            f"none of {len(model.grasps)} grasps can be done",
            tuple(verdicts.values()),
            seconds,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Judged:
    """The verdict on a grasp, and the postures that do it."""

    verdict: GraspAssessment
    candidates: tuple[_Candidate, ...] = ()


class _Attempt:
    """What one call of the planner works with: the robot where it stands, in its scene."""

    def __init__(
        self,
        robot: Robot,
        config: PlannerConfig,
        start: RobotState,
        scene: Scene,
        leaving: frozenset[str],
    ) -> None:
        self._config = config
        self._start = robot.arm(start)
        self._kinematics = Kinematics(robot, start, config.inverse)
        self._checker = CollisionChecker(robot, scene, state=start)
        self._lying = scene.object
        scene.check_names(leaving)
        movers = (*body_names(robot.model), OBJECT)
        self._leaving = leaving
        self._gone = frozenset(frozenset((mover, name)) for mover in movers for name in leaving)

    def judge(
        self,
        grasp: CanonicalGrasp,
        model: ObjectModel,
        T_base_object: RigidTransform,
        covariance: Float64Array | None,
        widest: float,
    ) -> _Judged:
        """Can the arm hold the object by this grasp, with what is known of its pose?"""
        figures: dict[str, float] = {}
        too_wide = grasp.why_too_wide(widest)
        if too_wide:
            return _refused(grasp, too_wide, figures)
        low, high = extent_between_fingers(grasp, model.outer_body, self._config.gripper)
        fit = 1.0
        if low <= high:
            figures["clearance"] = clearance = grasp.opening / 2 - max(high, -low)
            if clearance < 0:
                return _refused(
                    grasp,
                    f"the object does not fit between the fingers: {1000 * (high - low):.0f} mm "
                    f"in an opening of {1000 * grasp.opening:.0f} mm, and "
                    f"{1000 * abs(high + low) / 2:.0f} mm off its middle",
                    figures,
                )
            if covariance is not None:
                figures["closing_sigma"] = sigma = closing_sigma(grasp, covariance)
                fit = math.erf(clearance / (math.sqrt(2) * max(sigma, 1e-9)))
        if fit < self._config.fit:
            return _refused(
                grasp,
                f"the pose is too uncertain: {1000 * figures['closing_sigma']:.1f} mm (one sigma) "
                f"between fingers with {1000 * figures['clearance']:.1f} mm to spare",
                figures,
            )
        result = self._kinematics.inverse(
            grasp.adapt(T_base_object), self._start, seed=self._config.seed
        )
        figures |= {
            "position_error": result.position_error,
            "rotation_error": result.rotation_error,
        }
        if not result:
            return _refused(grasp, result.reason, figures)
        reason = ""
        candidates = []
        for solution in result.solutions[: self._config.solutions]:
            contact = self._checker.check(
                solution.q, grasp.opening, allowed=self._checker.fingers_on_object
            )
            if contact is not None:
                reason = reason or f"in collision: {contact}"
                continue
            candidates.append(self._candidate(grasp, solution, fit, figures))
        if not candidates:
            return _refused(grasp, reason, figures)
        best = max(candidates, key=lambda c: c.assessment.score)
        return _Judged(best.assessment, tuple(candidates))

    def ways(
        self, candidate: _Candidate, T_base_object: RigidTransform
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
        up = grasp.adapt(T_base_object)
        raised = RigidTransform.from_translation([0.0, 0.0, self._config.lift]) * up
        lift = straight_line(
            self._kinematics,
            self._checker,
            candidate.q,
            raised,
            opening=opening,
            allowed=self._gone,
            config=motion,
        )
        if isinstance(lift, MotionFailure):
            return f"it cannot be lifted by {self._config.lift:g} m: {lift.reason}"
        against = self._lifted_into(lift, opening)
        if against:
            return f"it cannot be lifted by {self._config.lift:g} m: object goes into {against}"
        self._checker.set_object(lying)
        move = plan_path(
            self._checker,
            self._start,
            back.end,
            opening=opening,
            seed=self._config.seed,
            config=motion,
        )
        if isinstance(move, MotionFailure):
            return f"no way to its pre-grasp: {move.reason}"
        return move, back.reversed(), lift

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
    ) -> _Candidate:
        manipulability = self._kinematics.manipulability(solution.q)
        score = _score(solution, manipulability, fit)
        figures = {
            **figures,
            "limit_margin": solution.limit_margin,
            "manipulability": manipulability,
        }
        assessment = GraspAssessment(grasp.name, True, "", score, figures)
        return _Candidate(grasp, assessment, solution.q)


def _score(solution: IKSolution, manipulability: float, fit: float) -> float:
    """0 … 1: far from limits and singularities, near to where the arm is, sure of the object."""
    margin = min(solution.limit_margin / 0.3, 1.0)
    agile = min(manipulability / 0.05, 1.0)
    near = 1.0 - min(solution.distance / (2 * math.pi), 1.0)
    return fit * (0.4 * margin + 0.3 * agile + 0.3 * near)


def _refused(grasp: CanonicalGrasp, reason: str, figures: dict[str, float]) -> _Judged:
    return _Judged(GraspAssessment(grasp.name, False, reason, 0.0, dict(figures)))


def _chosen_first(verdicts: dict[str, GraspAssessment], name: str) -> tuple[GraspAssessment, ...]:
    others = (verdict for grasp, verdict in verdicts.items() if grasp != name)
    return (verdicts[name], *sorted(others, key=lambda v: -v.score))
