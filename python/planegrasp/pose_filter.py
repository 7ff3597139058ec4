"""An error-state Kalman filter for the pose and velocity of something that moves smoothly.

The state is a rigid pose in a fixed frame with a linear and an angular velocity, all constant but
for a white acceleration. Its uncertainty lives in the tangent space: a 12-vector of errors
(translation, rotation, linear velocity, angular velocity) in the axes of the fixed frame (Solà,
*Quaternion kinematics for the error-state Kalman filter*, 2017, with global angular errors).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Float64Array = NDArray[np.float64]

__all__ = ["FilteredPose", "PoseFilterConfig", "correct", "first_pose", "predict"]

_POSE, _VELOCITY = slice(0, 6), slice(6, 12)


@dataclass(frozen=True, slots=True)
class PoseFilterConfig:
    """What is assumed of the motion.

    Attributes:
        linear_acceleration: standard deviation [m/s²] of what changes the velocity in a second; 0.1
            suits something that a person holds: it drifts by 0.1 m/s and turns back in a second or
            two.
        angular_acceleration: the same for the rotation [rad/s²].
        linear_speed: standard deviation of the velocity [m/s] before it was ever measured.
        angular_speed: the same for the rotation [rad/s].
        tremor: standard deviation [m] of a motion too fast to follow, which a measured position
            has beside its own error.
        angular_tremor: the same for the rotation [rad].
        gate: measurements whose squared Mahalanobis distance from the prediction is more than its
            square above the expected 6 are refused; 5 refuses one of 40 000 good ones.
    """

    linear_acceleration: float = 0.1
    angular_acceleration: float = 0.3
    linear_speed: float = 0.15
    angular_speed: float = 0.3
    tremor: float = 0.0005
    angular_tremor: float = 0.003
    gate: float = 5.0

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0) or (name == "gate" and value == 0):
                raise InvalidInputError(f"{name} of the pose filter must be ≥ 0, got {value}")


@dataclass(frozen=True, slots=True, eq=False)
class FilteredPose:
    """What the filter believes at one time.

    Attributes:
        time: [s].
        T_base_object: the pose in the fixed frame, for example the robot's base.
        linear_velocity: 3, of the object's origin along the base's axes [m/s].
        angular_velocity: 3, about the base's axes [rad/s].
        covariance: 12×12 of (translation, rotation vector, linear, angular velocity) along the
            base's axes.
    """

    time: float
    T_base_object: RigidTransform
    linear_velocity: Float64Array
    angular_velocity: Float64Array
    covariance: Float64Array


def first_pose(
    time: float,
    T_base_object: RigidTransform,
    covariance: Float64Array,
    config: PoseFilterConfig,
) -> FilteredPose:
    """Start from one measurement, with velocity unknown.

    Args:
        time: of the measurement [s].
        T_base_object: as measured.
        covariance: 6×6 of (translation, rotation vector) in the object's frame, as detections
            have it.
        config: what is assumed of the motion.
    """
    P = np.zeros((12, 12))
    P[_POSE, _POSE] = _in_base_axes(covariance, T_base_object.rotation) + _tremor(config)
    P[_VELOCITY, _VELOCITY] = np.diag([config.linear_speed**2] * 3 + [config.angular_speed**2] * 3)
    return FilteredPose(time, T_base_object, np.zeros(3), np.zeros(3), P)


def predict(state: FilteredPose, time: float, config: PoseFilterConfig) -> FilteredPose:
    """The state at a later time, by constant velocity.

    Raises:
        InvalidInputError: the time lies before that of the state, or is not finite.
    """
    dt = time - state.time
    if not (math.isfinite(dt) and dt >= 0):
        raise InvalidInputError(
            f"a pose filter only goes forward in time: it is at {state.time} s, got {time} s"
        )
    turn = Rotation.from_rotvec(state.angular_velocity * dt)
    T = RigidTransform.from_components(
        state.T_base_object.translation + state.linear_velocity * dt,
        turn * state.T_base_object.rotation,
    )
    F = np.eye(12)
    F[3:6, 3:6] = turn.as_matrix()
    F[_POSE, _VELOCITY] = dt * np.eye(6)
    acceleration = np.array(
        [config.linear_acceleration**2] * 3 + [config.angular_acceleration**2] * 3
    )
    # White acceleration of that power spectral density, integrated once and twice over dt.
    Q = np.zeros((12, 12))
    Q[_POSE, _POSE] = np.diag(acceleration * dt**3 / 3)
    Q[_VELOCITY, _VELOCITY] = np.diag(acceleration * dt)
    Q[_POSE, _VELOCITY] = Q[_VELOCITY, _POSE] = np.diag(acceleration * dt**2 / 2)
    return replace(state, time=time, T_base_object=T, covariance=F @ state.covariance @ F.T + Q)


def correct(
    state: FilteredPose,
    T_base_object: RigidTransform,
    covariance: Float64Array,
    config: PoseFilterConfig,
) -> FilteredPose | None:
    """The state with a measurement of its own time taken in, or None where the gate refuses it.

    Args:
        state: predicted to the time of the measurement.
        T_base_object: as measured.
        covariance: 6×6 in the object's frame, see `first_pose`.
        config: what is assumed of the motion.
    """
    error = np.concatenate(
        [
            T_base_object.translation - state.T_base_object.translation,
            (T_base_object.rotation * state.T_base_object.rotation.inv()).as_rotvec(),
        ]
    )
    P = state.covariance
    R = _in_base_axes(covariance, T_base_object.rotation) + _tremor(config)
    S = P[_POSE, _POSE] + R
    if float(error @ np.linalg.solve(S, error)) > config.gate**2 + 6:
        return None
    K = np.linalg.solve(S, P[_POSE, :]).T
    change = K @ error
    # Joseph's form stays symmetric and positive definite under rounding.
    I_KH = np.eye(12)
    I_KH[:, _POSE] -= K
    return FilteredPose(
        state.time,
        RigidTransform.from_components(
            state.T_base_object.translation + change[:3],
            Rotation.from_rotvec(change[3:6]) * state.T_base_object.rotation,
        ),
        state.linear_velocity + change[6:9],
        state.angular_velocity + change[9:12],
        I_KH @ P @ I_KH.T + K @ R @ K.T,
    )


def _tremor(config: PoseFilterConfig) -> Float64Array:
    return np.diag([config.tremor**2] * 3 + [config.angular_tremor**2] * 3)


def _in_base_axes(covariance: Float64Array, rotation: Rotation) -> Float64Array:
    """A 6×6 covariance of the object's axes in those of the base."""
    C = np.asarray(covariance, dtype=np.float64)
    if C.shape != (6, 6) or not np.all(np.isfinite(C)):
        raise InvalidInputError(f"a pose's covariance is a finite 6×6 matrix, got {C.shape}")
    turn = np.kron(np.eye(2), rotation.as_matrix())
    return np.asarray(turn @ C @ turn.T, dtype=np.float64)
