"""What pose estimation takes and gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from planegrasp.errors import PoseError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from planegrasp.geometry import RigidTransform
    from planegrasp.rgbd import RGBDFrame


@dataclass(frozen=True, slots=True, eq=False)
class FaceObservation:
    """The evidence for one face in one frame: everything that a pose is computed from.

    Attributes:
        T_object_face: pose of the face in its object's frame.
        width: of the face [m].
        height: of the face [m].
        face_points: N×2 inlier points on the face [m], x right, y up, origin at its centre.
        image_points: N×2 where the camera saw them, undistorted pixels.
        homography: 3×3, from face points [m] to undistorted pixels.
    """

    T_object_face: RigidTransform
    width: float
    height: float
    face_points: NDArray[np.float64]
    image_points: NDArray[np.float64]
    homography: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PoseEstimate:
    """A pose with what is known of its quality.

    Attributes:
        T_camera_object: pose of the object in the camera's optical frame.
        covariance: 6×6 of (translation [m], rotation vector [rad]) in the object's frame, or None
            where the method does not give one (three_point).
        ambiguous: whether `alternative` explains the evidence about as well.
        alternative: the other planar solution, where there is one.
        reprojection_rms: of the inliers [px].
        depth_pixels: how many depth measurements took part.
        noise_covariance: the part of the covariance that differs from frame to frame. What is
            unknown of the taught size and of the camera's depth scale is the same in all of them
            and left out: filters over time need this, whoever reaches for the object the whole.
    """

    T_camera_object: RigidTransform
    covariance: NDArray[np.float64] | None
    ambiguous: bool
    alternative: RigidTransform | None
    reprojection_rms: float
    depth_pixels: int
    noise_covariance: NDArray[np.float64] | None = None


class PoseEstimator(Protocol):
    """Computes the pose of one object from its faces seen in one frame."""

    @property
    def name(self) -> str: ...  # noqa: D102 - as in `DetectorConfig.pose`

    def estimate(self, faces: Sequence[FaceObservation], frame: RGBDFrame) -> PoseEstimate:
        """Pose of the object that carries these faces (at least one).

        Raises:
            PoseError: the evidence does not determine a pose; the message says what is missing.
        """
        ...

    def estimate_all(
        self, objects: Sequence[Sequence[FaceObservation]], frame: RGBDFrame
    ) -> list[PoseEstimate | PoseError]:
        """The same for each of several objects: its pose, or the error that says why not."""
        ...


def one_by_one(
    estimator: PoseEstimator, objects: Sequence[Sequence[FaceObservation]], frame: RGBDFrame
) -> list[PoseEstimate | PoseError]:
    """`PoseEstimator.estimate_all` by `estimate`, for estimators that are quick anyway."""

    def attempt(faces: Sequence[FaceObservation]) -> PoseEstimate | PoseError:
        try:
            return estimator.estimate(faces, frame)
        except PoseError as error:
            return error

    return [attempt(faces) for faces in objects]
