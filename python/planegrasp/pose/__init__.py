"""Pose estimation: from the inliers of an object's faces and the depth image to 6 degrees.

`fused` is the default; `pnp` needs no depth; `three_point` is the paper's, to measure against.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError
from planegrasp.pose.base import FaceObservation, PoseEstimate, PoseEstimator
from planegrasp.pose.fused import FusedConfig, FusedEstimator
from planegrasp.pose.pnp import PnPConfig, PnPEstimator
from planegrasp.pose.three_point import ThreePointEstimator

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = [
    "POSE_ESTIMATORS",
    "FaceObservation",
    "FusedConfig",
    "FusedEstimator",
    "PnPConfig",
    "PnPEstimator",
    "PoseEstimate",
    "PoseEstimator",
    "ThreePointEstimator",
    "make_pose_estimator",
]

POSE_ESTIMATORS: dict[str, Callable[[], PoseEstimator]] = {
    "fused": FusedEstimator,
    "pnp": PnPEstimator,
    "three_point": ThreePointEstimator,
}
"""Estimators by name, the default first."""


def make_pose_estimator(name: str = "fused") -> PoseEstimator:
    """The estimator of that name with its default settings.

    Raises:
        InvalidInputError: there is none of that name.
    """
    if name not in POSE_ESTIMATORS:
        known = ", ".join(POSE_ESTIMATORS)
        raise InvalidInputError(f"unknown pose estimator {name!r}: choose one of {known}")
    return POSE_ESTIMATORS[name]()
