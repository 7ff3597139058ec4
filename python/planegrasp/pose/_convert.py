"""Between planegrasp's types and those of the compiled core."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planegrasp import _core
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform
from planegrasp.pose.base import PoseEstimate

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from planegrasp.pose.base import FaceObservation


def to_core_faces(faces: Sequence[FaceObservation]) -> list[_core.Face]:
    """The faces as the core takes them."""
    return [to_core_face(face) for face in faces]


def to_core_face(face: FaceObservation) -> _core.Face:
    """One face as the core takes it.

    Raises:
        InvalidInputError: an array has a wrong shape or values that are not finite.
        PoseError: the homography does not show the front of the face.
    """
    return _core.Face(
        face.T_object_face.as_matrix(),
        face.width,
        face.height,
        _floats(face.face_points, "face_points"),
        _floats(face.image_points, "image_points"),
        _floats(face.homography, "homography"),
    )


def from_core(estimate: _core.Estimate) -> PoseEstimate:
    """The core's estimate as planegrasp's."""
    (converted,) = all_from_core([estimate])
    return converted


def all_from_core(estimates: Sequence[_core.Estimate]) -> list[PoseEstimate]:
    """The core's estimates as planegrasp's; their transforms are made together, which is faster."""
    if not estimates:
        return []
    transforms = _transform(np.stack([estimate.T_camera_object for estimate in estimates]))
    return [_estimate(e, T) for e, T in zip(estimates, transforms, strict=True)]


def _estimate(estimate: _core.Estimate, T_camera_object: RigidTransform) -> PoseEstimate:
    alternative = estimate.alternative
    return PoseEstimate(
        T_camera_object=T_camera_object,
        covariance=estimate.covariance,
        ambiguous=estimate.ambiguous,
        alternative=None if alternative is None else _transform(alternative),
        reprojection_rms=estimate.reprojection_rms,
        depth_pixels=estimate.depth_pixels,
        noise_covariance=estimate.noise_covariance,
    )


def _transform(T: NDArray[np.float64]) -> RigidTransform:
    # The core's transforms are rigid: making them so again takes ten times as long.
    return RigidTransform(T, normalize=False)


def _floats(values: ArrayLike, name: str) -> NDArray[np.float64]:
    try:
        return np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{name} must be an array of numbers: {error}") from error
