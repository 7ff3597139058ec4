"""A grasp relative to its object: taught once, adapted to wherever the object is.

The gripper's frame lies between its fingertips: x points out of the palm, the fingers close along
y (docs/conventions.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.checks import check_name
from planegrasp.errors import GraspError
from planegrasp.geometry import RigidTransform, checked_transform, euler_from_rotation

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike

__all__ = ["CanonicalGrasp", "check_unique"]

# Beyond these a number is in another unit, or a transform between other frames.
_FARTHEST = 1.0
_WIDEST = 1.0
_LONGEST_PREGRASP = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class CanonicalGrasp:
    """How a gripper holds an object, whatever the object's pose.

    Transforms are given as `RigidTransform` or as 4×4 matrices.

    Attributes:
        name: of the grasp, unique within its object: letters, digits, '-', '_' and '.'; parts
            joined by '/', as symmetric variants have them ("side/flipped").
        T_object_gripper: pose of the gripper in the object, at most 1 m away.
        opening: gap between the fingertips while the gripper moves over the object [m].
        approach: unit vector in the gripper's frame along which it moves over the object.
        pregrasp_distance: how far before the grasp, against `approach`, the gripper starts [m].
        force: with which the fingers close [N].

    Raises:
        GraspError: the gripper is more than 1 m away from the object, the opening or the pregrasp
            distance is not within 0 … 1 m, the approach is no unit vector, the force not positive.
        InvalidInputError: for another name, or a matrix that is no rigid transform.
    """

    name: str
    T_object_gripper: RigidTransform
    opening: float
    approach: tuple[float, float, float] = (1.0, 0.0, 0.0)
    pregrasp_distance: float = 0.10
    force: float = 40.0

    def __post_init__(self) -> None:
        what = f"grasp {self.name!r}"
        for part in self.name.split("/") if isinstance(self.name, str) else (self.name,):
            check_name(part, "a grasp, or part of one")
        T = checked_transform(self.T_object_gripper, f"{what}: T_object_gripper")
        distance = float(np.linalg.norm(T.translation))
        if distance > _FARTHEST:
            raise GraspError(f"{what}: {_too_far(distance)}")
        object.__setattr__(self, "T_object_gripper", T)
        object.__setattr__(self, "opening", _within(self.opening, _WIDEST, f"{what}: opening"))
        object.__setattr__(self, "approach", _unit(self.approach, f"{what}: approach"))
        pregrasp = _within(self.pregrasp_distance, _LONGEST_PREGRASP, f"{what}: pregrasp_distance")
        object.__setattr__(self, "pregrasp_distance", pregrasp)
        force = float(self.force)
        if not math.isfinite(force) or force <= 0:
            raise GraspError(f"{what}: force must be > 0 N and finite, got {self.force}")
        object.__setattr__(self, "force", force)

    @classmethod
    def teach(
        cls,
        name: str,
        T_base_object: RigidTransform | ArrayLike,
        T_base_gripper: RigidTransform | ArrayLike,
        *,
        opening: float,
        approach: tuple[float, float, float] = (1.0, 0.0, 0.0),
        pregrasp_distance: float = 0.10,
        force: float = 40.0,
    ) -> CanonicalGrasp:
        """Learn a grasp from where object and gripper are at one time (paper, eq. 10).

        T_object_gripper = (T_base_object)⁻¹ · T_base_gripper. Any other common frame does as well
        as the base, for example the camera's.

        Args:
            name: see the class, as all the others.
            T_base_object: pose of the object in the robot's base.
            T_base_gripper: pose of the gripper in the robot's base.
            opening: [m].
            approach: unit vector in the gripper's frame.
            pregrasp_distance: [m].
            force: [N].

        Raises:
            GraspError: see the class. Where the gripper would be too far away, the message says
                which transform, inverted, would put it near.
            InvalidInputError: see the class.
        """
        T_o = checked_transform(T_base_object, f"grasp {name!r}: T_base_object")
        T_g = checked_transform(T_base_gripper, f"grasp {name!r}: T_base_gripper")
        T_object_gripper = T_o.inv() * T_g
        distance = float(np.linalg.norm(T_object_gripper.translation))
        if distance > _FARTHEST:
            raise GraspError(f"grasp {name!r}: {_too_far(distance)}{_nearer(T_o, T_g)}")
        return cls(name, T_object_gripper, opening, approach, pregrasp_distance, force)

    @property
    def T_object_pregrasp(self) -> RigidTransform:
        """Pose of the gripper in the object before it approaches."""
        back = RigidTransform.from_translation(-self.pregrasp_distance * np.array(self.approach))
        return self.T_object_gripper * back

    def adapt(self, T_base_object: RigidTransform | ArrayLike) -> RigidTransform:
        """T_base_gripper = T_base_object · T_object_gripper (paper, eq. 11)."""
        return checked_transform(T_base_object, "T_base_object") * self.T_object_gripper

    def pregrasp(self, T_base_object: RigidTransform | ArrayLike) -> RigidTransform:
        """Pose of the gripper in the base before it approaches an object at this pose."""
        return checked_transform(T_base_object, "T_base_object") * self.T_object_pregrasp

    def euler(self, T_base_object: RigidTransform | ArrayLike) -> tuple[float, float, float]:
        """Roll, pitch, yaw (φ, θ, ψ) of the adapted gripper in the base (paper, eq. 12) [rad]."""
        return euler_from_rotation(self.adapt(T_base_object).rotation)

    def why_too_wide(self, widest: float) -> str:
        """Why a gripper that opens to `widest` [m] cannot do it, with figures; "" if it can."""
        if self.opening <= widest:
            return ""
        return (
            f"needs the fingertips {1000 * self.opening:.1f} mm apart, the gripper opens to "
            f"{1000 * widest:.1f} mm"
        )


def check_unique(grasps: Iterable[CanonicalGrasp], name: str) -> None:
    """Refuse two grasps of one name, and what is no grasp; `name` is the object's.

    Raises:
        GraspError: two names are the same; upper and lower case count as the same.
    """
    seen: set[str] = set()
    for grasp in grasps:
        if not isinstance(grasp, CanonicalGrasp):
            raise GraspError(
                f"grasps of object {name!r} must be CanonicalGrasp, got {type(grasp).__name__}"
            )
        if grasp.name.lower() in seen:
            raise GraspError(
                f"object {name!r} has two grasps named {grasp.name!r} (upper and lower case count "
                f"as the same): rename or remove one"
            )
        seen.add(grasp.name.lower())


def _within(value: float, most: float, what: str) -> float:
    number = float(value)
    if not 0 < number <= most:
        hint = f": is it in millimetres ({number / 1000:g} m)?" if most < number <= 1000 else ""
        raise GraspError(f"{what} must be > 0 and at most {most:g} m, got {value:g}{hint}")
    return number


def _unit(value: ArrayLike, what: str) -> tuple[float, float, float]:
    vector = np.asarray(value, dtype=np.float64)
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else math.nan
    if not abs(length - 1.0) <= 1e-3:
        right = ""
        if math.isfinite(length) and length > 0:
            right = f": did you mean {[round(v, 6) for v in (vector / length).tolist()]}?"
        raise GraspError(
            f"{what} must be a unit vector of three numbers in the gripper's frame, got "
            f"{vector.tolist()}{right}"
        )
    x, y, z = (vector / length).tolist()
    return x, y, z


def _too_far(distance: float) -> str:
    return (
        f"the gripper would be {distance:.3g} m away from the object, at most {_FARTHEST:g} m are "
        f"right: are frames swapped, or translations not in metres?"
    )


def _nearer(T_o: RigidTransform, T_g: RigidTransform) -> str:
    """Which of the given transforms would put the gripper near if it were inverted."""
    inverted = {
        "T_object_base was given as T_base_object": T_o * T_g,
        "T_gripper_base was given as T_base_gripper": T_o.inv() * T_g.inv(),
        "both were given inverted": T_o * T_g.inv(),
    }
    distances = {what: float(np.linalg.norm(T.translation)) for what, T in inverted.items()}
    what = min(distances, key=distances.__getitem__)
    if distances[what] > _FARTHEST:
        return " Inverting one or both of them would not put it within that either."
    return f" If {what}, it is {distances[what]:.3g} m: invert it."
