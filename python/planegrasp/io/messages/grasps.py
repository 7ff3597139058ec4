"""What a grasp planner says."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from planegrasp.io.messages.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.grasping.plan import GraspAssessment, GraspPlan, GraspRefusal
    from planegrasp.io.messages.header import Header
    from planegrasp.robot.path import Path

__all__ = ["GraspPlanMessage", "GraspRefusalMessage", "GraspVerdict", "grasp_message"]

JointPath = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class GraspVerdict:
    """The verdict on one grasp.

    Attributes:
        grasp: its name.
        accepted: whether the arm can do it.
        reason: why not, or "".
        score: 0 … 1 of an accepted one.
        figures: numbers by name, see `GraspAssessment`; those that are not finite are left out.
    """

    grasp: str
    accepted: bool
    reason: str
    score: float
    figures: tuple[tuple[str, float], ...]


@dataclass(frozen=True, slots=True)
class GraspPlanMessage:
    """A grasp that the arm can do.

    Attributes:
        header: its frame is the robot's base.
        name: of the object.
        grasp: name of the grasp.
        object_pose: T_base_object.
        gripper_pose: T_base_gripper.
        pregrasp_pose: T_base_pregrasp.
        opening: of the gripper before it closes [m].
        force: to close with [N].
        joints: names of the arm's joints.
        move: joint positions from the start to the pre-grasp [rad or m], one tuple a point.
        reach: the same from there to the grasp.
        lift: the same upwards with the object.
        verdicts: on every grasp, the chosen one first.
    """

    header: Header
    name: str
    grasp: str
    object_pose: Pose
    gripper_pose: Pose
    pregrasp_pose: Pose
    opening: float
    force: float
    joints: tuple[str, ...]
    move: JointPath
    reach: JointPath
    lift: JointPath
    verdicts: tuple[GraspVerdict, ...]


@dataclass(frozen=True, slots=True)
class GraspRefusalMessage:
    """No grasp can be done: the robot must not move.

    Attributes:
        header: its frame is the robot's base.
        name: of the object.
        reason: in one line.
        verdicts: on each grasp, as far as they were looked at.
    """

    header: Header
    name: str
    reason: str
    verdicts: tuple[GraspVerdict, ...]


def grasp_message(
    result: GraspPlan | GraspRefusal, header: Header, joints: Sequence[str] = ()
) -> GraspPlanMessage | GraspRefusalMessage:
    """The message of what a planner said.

    Args:
        result: of the planner.
        header: with the stamp of the image that the object was seen in, and the base's frame.
        joints: names of the arm's joints, in the order of the plan's paths.
    """
    verdicts = tuple(_verdict(assessment) for assessment in result.assessments)
    if result.refused:
        return GraspRefusalMessage(header, result.name, result.reason, verdicts)
    return GraspPlanMessage(
        header=header,
        name=result.name,
        grasp=result.grasp.name,
        object_pose=Pose.of(result.T_base_object),
        gripper_pose=Pose.of(result.T_base_gripper),
        pregrasp_pose=Pose.of(result.T_base_pregrasp),
        opening=float(result.opening),
        force=float(result.force),
        joints=tuple(joints),
        move=_points(result.move),
        reach=_points(result.reach),
        lift=_points(result.lift),
        verdicts=verdicts,
    )


def _verdict(assessment: GraspAssessment) -> GraspVerdict:
    figures = tuple((n, float(v)) for n, v in assessment.figures.items() if math.isfinite(v))
    return GraspVerdict(
        assessment.grasp, assessment.accepted, assessment.reason, float(assessment.score), figures
    )


def _points(path: Path) -> JointPath:
    return tuple(tuple(point) for point in path.q.tolist())
