"""Whether a pose is known well enough to reach for the object."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.grasping.canonical import CanonicalGrasp

    Float64Array = NDArray[np.float64]

__all__ = ["closing_sigma", "doubt", "doubt_between_fingers", "doubt_covariance"]


def doubt(
    detection: Detection, translation_sigma: float, rotation_sigma: float, *, need_depth: bool
) -> str:
    """Why the pose of a detection is not good enough to grasp by; "" where it is.

    Args:
        detection: of the object.
        translation_sigma: largest standard deviation of the position in any direction [m].
        rotation_sigma: largest standard deviation of the rotation about any axis [rad].
        need_depth: whether a pose from the image alone is refused.
    """
    pose = detection.pose
    if pose is None:
        return f"the detection has no pose: {detection.pose_failure}"
    if need_depth and pose.depth_pixels == 0:
        return (
            "the pose is from the image alone, no depth was measured on the object: its distance "
            "depends on the taught size"
        )
    if pose.ambiguous:
        return "the pose is ambiguous: a second one explains the image about as well"
    if pose.covariance is None:
        return "the pose has no covariance: estimate it with `fused` or `pnp`"
    return doubt_covariance(pose.covariance, translation_sigma, rotation_sigma)


def doubt_covariance(
    covariance: Float64Array, translation_sigma: float, rotation_sigma: float
) -> str:
    """Why a 6×6 covariance (translation, rotation) is too large; "" where it is not."""
    translation = _largest_sigma(covariance[:3, :3])
    rotation = _largest_sigma(covariance[3:, 3:])
    if not translation <= translation_sigma:
        return (
            f"the position is uncertain by {1000 * translation:.1f} mm (one sigma), at most "
            f"{1000 * translation_sigma:.1f} mm are accepted"
        )
    if not rotation <= rotation_sigma:
        return (
            f"the rotation is uncertain by {math.degrees(rotation):.1f}° (one sigma), at most "
            f"{math.degrees(rotation_sigma):.1f}° are accepted"
        )
    return ""


def doubt_between_fingers(
    grasp: CanonicalGrasp,
    extent: tuple[float, float],
    covariance: Float64Array | None,
    least: float,
    figures: dict[str, float],
) -> tuple[str, float]:
    """Why the object would not be between the open fingers, and the probability that it is.

    Args:
        grasp: canonical.
        extent: of the object along the gripper's y where the fingers close [m], see
            `extent_between_fingers`.
        covariance: 6×6 of (translation, rotation vector) in the object's frame; None is exact.
        least: probability.
        figures: to which `clearance` and `closing_sigma` [m] are added.
    """
    low, high = extent
    if low > high:
        return "there is nothing of the object between the fingers", 0.0
    figures["clearance"] = clearance = grasp.opening / 2 - max(high, -low)
    if clearance < 0:
        return (
            f"the object does not fit between the fingers: {1000 * (high - low):.0f} mm "
            f"in an opening of {1000 * grasp.opening:.0f} mm, and "
            f"{1000 * abs(high + low) / 2:.0f} mm off its middle"
        ), 0.0
    if covariance is None:
        return "", 1.0
    figures["closing_sigma"] = sigma = closing_sigma(grasp, covariance)
    fit = math.erf(clearance / (math.sqrt(2) * max(sigma, 1e-9)))
    if fit < least:
        return (
            f"the pose is too uncertain: {1000 * sigma:.1f} mm (one sigma) between fingers "
            f"with {1000 * clearance:.1f} mm to spare"
        ), fit
    return "", fit


def closing_sigma(grasp: CanonicalGrasp, covariance: Float64Array) -> float:
    """Standard deviation [m] of the object between the fingers, along their closing direction.

    Args:
        grasp: canonical.
        covariance: 6×6 of (translation, rotation vector) in the object's frame.
    """
    point = grasp.T_object_gripper.translation
    closing = grasp.T_object_gripper.rotation.as_matrix()[:, 1]
    # A rotation w moves the point by w × point: closing · (w × point) = (point × closing) · w.
    gradient = np.concatenate([closing, np.cross(point, closing)])
    return math.sqrt(max(float(gradient @ covariance @ gradient), 0.0))


def _largest_sigma(covariance: Float64Array) -> float:
    """Largest standard deviation in any direction; NaN for what is no covariance."""
    values = np.linalg.eigvalsh(covariance)
    if not values[0] >= -1e-9 * np.abs(values).max():
        return math.nan
    return math.sqrt(max(float(values[-1]), 0.0))
