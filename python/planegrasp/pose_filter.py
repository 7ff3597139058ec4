"""An error-state Kalman filter for the pose and velocity of something that moves smoothly.

The state is a rigid pose in a fixed frame with a linear and an angular velocity, all constant but
for a white acceleration. Its uncertainty lives in the tangent space: a 12-vector of errors
(translation, rotation, linear velocity, angular velocity) in the axes of the fixed frame (Solà,
*Quaternion kinematics for the error-state Kalman filter*, 2017, with global angular errors). The
arithmetic is the core's (rust/core/src/pose_filter).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from planegrasp import _core
from planegrasp.geometry import RigidTransform

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Float64Array = NDArray[np.float64]

__all__ = [
    "FilteredPose",
    "PoseFilterConfig",
    "correct",
    "first_pose",
    "predict",
]


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
        self.settings()

    def settings(self) -> _core.PoseFilterSettings:
        """As the core takes them."""
        return _core.PoseFilterSettings(**asdict(self))


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

    @classmethod
    def of(cls, state: _core.FilteredPose) -> FilteredPose:
        """A state of the core."""
        return cls(
            state.time,
            # The core's transforms are rigid.
            RigidTransform(state.T_base_object, normalize=False),
            state.linear_velocity,
            state.angular_velocity,
            state.covariance,
        )

    def _core(self) -> _core.FilteredPose:
        return _core.FilteredPose(
            self.time,
            self.T_base_object.as_matrix(),
            self.linear_velocity,
            self.angular_velocity,
            self.covariance,
        )


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
    T = T_base_object.as_matrix()
    return FilteredPose.of(_core.FilteredPose.first(time, T, covariance, config.settings()))


def predict(state: FilteredPose, time: float, config: PoseFilterConfig) -> FilteredPose:
    """The state at a later time, by constant velocity.

    Raises:
        InvalidInputError: the time lies before that of the state, or is not finite.
    """
    return FilteredPose.of(state._core().predicted(time, config.settings()))


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
    T = T_base_object.as_matrix()
    corrected = state._core().corrected(T, covariance, config.settings())
    return None if corrected is None else FilteredPose.of(corrected)
