"""Poses, velocities and their covariances as ROS has them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import RigidTransform, transform_from_quaternion

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from planegrasp.body import BoxBody

__all__ = [
    "Box",
    "Pose",
    "PoseWithCovariance",
    "Triple",
    "TwistWithCovariance",
    "flat_covariance",
    "parent_covariance",
    "triple",
]

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """A pose in the frame that the message's header names.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w with w ≥ 0.
    """

    position: Triple
    orientation: tuple[float, float, float, float]

    @classmethod
    def of(cls, T: RigidTransform) -> Pose:
        """The pose of a transform."""
        # Its first half is the rotation; `T.rotation` would check a matrix first that is one.
        x, y, z, w, *_ = T.as_dual_quat().tolist()
        sign = math.copysign(1.0, w)
        return cls(triple(T.translation), (sign * x, sign * y, sign * z, sign * w))

    @property
    def T(self) -> RigidTransform:
        """The pose as a transform T_parent_child."""
        return transform_from_quaternion(self.position, self.orientation)

    def apply(self, point: Triple) -> Triple:
        """A point of the child's frame in the parent's [m]; for one, far faster than `T.apply`."""
        x, y, z, w = self.orientation
        a, b, c = point
        # p + 2 w (u × p) + 2 u × (u × p) of the quaternion (u, w).
        d, e, f = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
        px, py, pz = self.position
        return (
            px + a + w * d + y * f - z * e,
            py + b + w * e + z * d - x * f,
            pz + c + w * f + x * e - y * d,
        )


@dataclass(frozen=True, slots=True)
class PoseWithCovariance:
    """A pose and how well it is known.

    Attributes:
        pose: see there.
        covariance: 6×6, row by row, of (x, y, z, rotation about x, y, z) along the fixed axes of
            the parent frame [m², m·rad, rad²]; None where it is not known.
    """

    pose: Pose
    covariance: tuple[float, ...] | None


@dataclass(frozen=True, slots=True)
class TwistWithCovariance:
    """The velocity of an object's origin, along the axes of the frame that the header names.

    Attributes:
        linear: [m/s].
        angular: [rad/s].
        covariance: 6×6, row by row, of (linear, angular).
    """

    linear: Triple
    angular: Triple
    covariance: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Box:
    """The outer box of an object.

    Attributes:
        centre: in the object's frame [m].
        size: along the object's axes [m].
    """

    centre: Triple
    size: Triple

    @classmethod
    def of(cls, body: BoxBody) -> Box:
        """The box of a body."""
        return cls(body.centre, body.size)


def parent_covariance(
    T_parent_object: RigidTransform, covariance: ArrayLike
) -> NDArray[np.float64]:
    """Turn a covariance from planegrasp's convention to that of ROS.

    planegrasp: true pose = T · δ with a small motion δ (translation, rotation vector) in the
    object's frame. ROS: the translation is added and the rotation applied in the parent's frame.
    The two differ by the rotation R of T alone: both halves of δ are turned by it.

    Args:
        T_parent_object: the pose that the covariance belongs to.
        covariance: 6×6 in the object's frame.

    Returns:
        6×6 along the axes of the parent.
    """
    R = T_parent_object.as_matrix()[:3, :3]
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = R
    turned: NDArray[np.float64] = turn @ np.asarray(covariance, dtype=np.float64) @ turn.T
    return turned


def flat_covariance(covariance: ArrayLike) -> tuple[float, ...]:
    """36 numbers, row by row."""
    return tuple(np.asarray(covariance, dtype=np.float64).ravel().tolist())


def triple(values: ArrayLike) -> Triple:
    """Three floats."""
    x, y, z = np.asarray(values, dtype=np.float64).tolist()
    return x, y, z
