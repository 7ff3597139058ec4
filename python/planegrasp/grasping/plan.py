"""What a planner says: a plan, or a refusal with a reason for each grasp."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from planegrasp.geometry import euler_from_rotation

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planegrasp.geometry import RigidTransform
    from planegrasp.grasping.canonical import CanonicalGrasp
    from planegrasp.robot.path import Path

__all__ = ["GraspAssessment", "GraspPlan", "GraspRefusal"]


@dataclass(frozen=True, slots=True)
class GraspAssessment:
    """The verdict on one canonical grasp.

    Attributes:
        grasp: its name.
        accepted: whether the arm can do it; of grasps that a plan did not choose, as far as can be
            said without a path.
        reason: why not, in words with its figures; "" where accepted.
        score: 0 … 1 of an accepted grasp, larger is better.
        figures: the numbers by name, as far as it got: `position_error` [m] and `rotation_error`
            [rad] of the arm, `limit_margin` (0 … 1), `manipulability`, `clearance` [m] between an
            open finger and the object, `closing_sigma` [m] of the object between the fingers,
            `room` [m] to what holds it and moves, `visible` (0 … 1) of it for the camera then,
            `aside` [m] of where it was taught.
        hopeless: whether no other posture of the arm could change the verdict: no posture holds the
            object so, or the object would not be between the fingers.
    """

    grasp: str
    accepted: bool
    reason: str = ""
    score: float = 0.0
    figures: Mapping[str, float] = field(default_factory=dict)
    hopeless: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class GraspPlan:
    """A grasp that the arm can do, and how.

    Attributes:
        name: of the object.
        grasp: the canonical grasp that was chosen; beside a person a little aside, it may be.
        T_base_object: where the object is.
        T_base_gripper: the grasp adapted to it (paper, eq. 11).
        T_base_pregrasp: the same, moved back along the approach.
        move: of the arm from the start to the pre-grasp.
        reach: the straight line from the pre-grasp to the grasp.
        lift: the straight line upwards with the object.
        opening: of the gripper before it closes [m].
        force: to close with [N].
        assessments: of every grasp, the chosen one first.
        seconds: of each stage of planning.
    """

    name: str
    grasp: CanonicalGrasp
    T_base_object: RigidTransform
    T_base_gripper: RigidTransform
    T_base_pregrasp: RigidTransform
    move: Path
    reach: Path
    lift: Path
    opening: float
    force: float
    assessments: tuple[GraspAssessment, ...]
    seconds: Mapping[str, float]
    refused: Literal[False] = False

    @property
    def euler(self) -> tuple[float, float, float]:
        """Roll, pitch, yaw (φ, θ, ψ) [rad] of the gripper in the base (paper, eq. 12)."""
        return euler_from_rotation(self.T_base_gripper.rotation)

    @property
    def reasons(self) -> dict[str, str]:
        """Why grasps were refused, by name; one that is only worse than the chosen has none."""
        return {a.grasp: a.reason for a in self.assessments if not a.accepted}


@dataclass(frozen=True, slots=True, eq=False)
class GraspRefusal:
    """No grasp can be done: the robot must not move. It is false in a condition.

    Attributes:
        name: of the object.
        reason: in one line.
        assessments: of each grasp, as far as they were looked at.
        seconds: of each stage of planning.
    """

    name: str
    reason: str
    assessments: tuple[GraspAssessment, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)
    refused: Literal[True] = True

    @property
    def reasons(self) -> dict[str, str]:
        """Why each grasp was refused, by its name."""
        return {a.grasp: a.reason or self.reason for a in self.assessments}

    def __bool__(self) -> bool:
        return False
