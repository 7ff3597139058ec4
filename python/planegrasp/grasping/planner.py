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
from planegrasp.grasping.attempt import Attempt, Candidate
from planegrasp.grasping.canonical import check_unique
from planegrasp.grasping.clearance import GripperShape
from planegrasp.grasping.company import Company
from planegrasp.grasping.doubts import doubt
from planegrasp.grasping.plan import GraspAssessment, GraspPlan, GraspRefusal
from planegrasp.robot.ik import IKConfig
from planegrasp.robot.motion import MotionConfig
from planegrasp.robot.scene import ObjectBody, Scene

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from planegrasp.detection import Detection
    from planegrasp.objects import ObjectModel
    from planegrasp.robot.model import Robot
    from planegrasp.robot.path import Path
    from planegrasp.robot.state import RobotState

    Float64Array = NDArray[np.float64]

__all__ = ["GraspPlanner", "PlannerConfig"]


@dataclass(frozen=True, slots=True)
class PlannerConfig:
    """What a grasp must fulfil, and how much is tried.

    Attributes:
        translation_sigma: largest standard deviation of the object's position [m].
        rotation_sigma: largest standard deviation of its rotation [rad].
        need_depth: refuse poses that no depth took part in.
        fit: least probability that the object lies between the open fingers.
        margin: that the robot keeps from everything on its way to the pre-grasp, at least [m].
        wide_margin: that it keeps if there is such a way: fast arms cut corners, and people move
            [m].
        room: distance from what holds the object, and moves, from which on a grasp is none the
            better for more [m].
        sidestep: by how much a grasp that is close to a person's hand may be moved along the
            fingers' pads, away from it [m]; 0 keeps all as taught.
        close_margin: from what it must not touch, from there on, where it is slow [m].
        lift: how far up the object is taken [m],
        least_lift: and how far at least, where the arm or something above ends its way [m].
        gripper: shape of fingers and palm, for the width of the object between them.
        inverse: search for postures.
        thorough: the same again, for grasps of which no posture has a way.
        motion: search for paths.
        searches: so many of them at length and in vain, and no more are begun.
        seed: of all that is random.
    """

    translation_sigma: float = 0.02
    rotation_sigma: float = math.radians(3.0)
    need_depth: bool = True
    fit: float = 0.7
    margin: float = 0.005
    wide_margin: float = 0.03
    room: float = 0.10
    sidestep: float = 0.015
    close_margin: float = 0.001
    lift: float = 0.12
    least_lift: float = 0.105
    gripper: GripperShape = field(default_factory=GripperShape)
    inverse: IKConfig = field(default_factory=IKConfig)
    thorough: IKConfig = field(default_factory=lambda: IKConfig(solutions=16, starts=40))
    motion: MotionConfig = field(default_factory=MotionConfig)
    searches: int = 4
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("translation_sigma", "rotation_sigma", "lift", "room"):
            if not getattr(self, name) > 0:
                raise InvalidInputError(f"{name} must be > 0, got {getattr(self, name)}")
        if self.seed < 0:
            raise InvalidInputError(f"a seed must be ≥ 0, got {self.seed}")
        if not 0 <= self.fit < 1:
            raise InvalidInputError(f"fit is a probability below 1, got {self.fit}")


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
            T_base_camera=T_base_camera,
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
        T_base_camera: RigidTransform | None = None,
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
            T_base_camera: from where the object is watched, if it moves.
        """
        T_base_object = checked_transform(T_base_object, "T_base_object")
        check_unique(model.grasps, model.name)
        if not model.grasps:
            return GraspRefusal(
                model.name, "no grasp is taught: show one (`planegrasp grasp teach`)"
            )
        body = model.outer_body
        lying = ObjectBody(body.size, T_base_object, None, body.centre, frozenset(supports))
        start = self.robot.home if start is None else start
        surroundings, left = (scene or Scene()).with_object(lying), frozenset(leaving)
        surroundings.check_names(left)
        company = None
        if left:
            company = Company(
                self.robot,
                start,
                tuple(box for box in surroundings.obstacles if box.name in left),
                room=self.config.room,
                body=body,
                T_base_object=T_base_object,
                T_base_camera=T_base_camera,
            )
        attempt = Attempt(
            self.robot, self.config, start, surroundings, leaving=left, company=company
        )
        verdicts: dict[str, GraspAssessment] = {}
        seconds = {"selection": 0.0, "motion": 0.0}
        # Where no posture of a first, quick search has a way, a thorough one may find one that has.
        for thorough in (False, True):
            mark = time.perf_counter()
            candidates: list[Candidate] = []
            for grasp in model.grasps:
                if thorough and verdicts[grasp.name].hopeless:
                    continue
                judged = attempt.judge(grasp, model, T_base_object, covariance, thorough=thorough)
                verdicts[grasp.name] = judged.verdict
                candidates += judged.candidates
            seconds["selection"] += time.perf_counter() - mark
            mark = time.perf_counter()
            chosen = _with_a_way(attempt, candidates, T_base_object, verdicts)
            seconds["motion"] += time.perf_counter() - mark
            if chosen is not None:
                candidate, (move, reach, lift) = chosen
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
        return GraspRefusal(
            model.name,
            f"none of {len(model.grasps)} grasps can be done",
            tuple(verdicts.values()),
            seconds,
        )


def _with_a_way(
    attempt: Attempt,
    candidates: Iterable[Candidate],
    T_base_object: RigidTransform,
    verdicts: dict[str, GraspAssessment],
) -> tuple[Candidate, tuple[Path, Path, Path]] | None:
    """The best candidate that has a way, and the way; the verdicts are brought up to date."""
    for candidate in sorted(candidates, key=lambda c: -c.assessment.score):
        name = candidate.grasp.name
        ways = attempt.ways(candidate, T_base_object)
        if not isinstance(ways, str):
            verdicts[name] = candidate.assessment
            return candidate, ways
        # What the best posture fails by is the reason, not what the others fail by.
        if verdicts[name].accepted:
            verdicts[name] = replace(candidate.assessment, accepted=False, reason=ways, score=0.0)
    return None


def _chosen_first(verdicts: dict[str, GraspAssessment], name: str) -> tuple[GraspAssessment, ...]:
    others = (verdict for grasp, verdict in verdicts.items() if grasp != name)
    return (verdicts[name], *sorted(others, key=lambda v: -v.score))
