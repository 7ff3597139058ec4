"""What the detector says: found objects with their poses, and why others were not found."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planegrasp.geometry import euler_from_rotation

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from planegrasp.geometry import RigidTransform
    from planegrasp.objects import ObjectModel
    from planegrasp.pose.base import PoseEstimate


@dataclass(frozen=True, slots=True, eq=False)
class FaceDetection:
    """One face of an object, found in one frame.

    Attributes:
        name: of the face.
        homography: 3×3, from the reference image (edge coordinates: (0, 0) is the outer corner of
            the first pixel) to undistorted pixels of the frame; scaled to H[2, 2] = 1.
        matched_homography: the same from the matches alone, before the grey values of the face were
            aligned with its reference.
        corners: 4×2 pixels of the frame as observed (distorted): where the reference's top-left,
            top-right, bottom-right and bottom-left corners lie.
        reference_points: N×2 inliers in the reference image (edge coordinates).
        image_points: N×2 the same inliers in the frame (undistorted pixels).
        coverage: share of the face, 0 … 1, over which the inliers are spread.
        agreement: share of the face's textured cells, 0 … 1, that look like the reference.
    """

    name: str
    homography: NDArray[np.float64]
    matched_homography: NDArray[np.float64]
    corners: NDArray[np.float64]
    reference_points: NDArray[np.float64]
    image_points: NDArray[np.float64]
    coverage: float
    agreement: float

    @property
    def inliers(self) -> int:
        """Number of matches that agree with the homography."""
        return len(self.image_points)

    @property
    def is_aligned(self) -> bool:
        """Whether the grey values of the face made the homography better than its matches did."""
        return self.homography is not self.matched_homography

    @property
    def score(self) -> float:
        """Confidence 0 … 1: how much of the face is seen, and by how many inliers."""
        return self.agreement * (1.0 - math.exp(-self.inliers / 15.0))


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """One object found in one frame.

    Attributes:
        model: the object that was found, as the detector knows it, with its body and grasps.
        instance: 0 for the best supported instance of this object in the frame, then 1, 2, …
        faces: the faces that were found, best supported first.
        score: confidence 0 … 1, see `FaceDetection.score`; faces of one object add up.
        pose: the estimated pose, or None where the method could not give one.
        pose_failure: why there is no pose; "" where there is one.
        tracked: whether it was followed from the frame before rather than found anew; its inliers
            are the parts of the faces that agree then.
    """

    model: ObjectModel
    instance: int
    faces: tuple[FaceDetection, ...]
    score: float
    pose: PoseEstimate | None
    pose_failure: str = ""
    tracked: bool = False

    @property
    def name(self) -> str:
        """Name of the object in the library."""
        return self.model.name

    @property
    def inliers(self) -> int:
        """Number of inliers of all faces together."""
        return sum(face.inliers for face in self.faces)

    @property
    def homography(self) -> NDArray[np.float64]:
        """Homography of the best supported face, see `FaceDetection.homography`."""
        return self.faces[0].homography

    @property
    def corners(self) -> NDArray[np.float64]:
        """Corners of the best supported face, see `FaceDetection.corners`."""
        return self.faces[0].corners

    @property
    def T_camera_object(self) -> RigidTransform | None:
        """Pose of the object in the camera's optical frame."""
        return self.pose.T_camera_object if self.pose else None

    @property
    def covariance(self) -> NDArray[np.float64] | None:
        """6×6 covariance of (translation, rotation vector) in the object's frame."""
        return self.pose.covariance if self.pose else None

    @property
    def euler(self) -> tuple[float, float, float] | None:
        """Roll, pitch, yaw (φ, θ, ψ) of the object in the camera's frame (paper, eq. 6-8)."""
        return euler_from_rotation(self.pose.T_camera_object.rotation) if self.pose else None

    @property
    def ambiguous(self) -> bool:
        """Whether a second pose, `alternative`, explains what was seen about as well."""
        return self.pose.ambiguous if self.pose else False

    @property
    def alternative(self) -> RigidTransform | None:
        """The other planar solution, where there is one."""
        return self.pose.alternative if self.pose else None


@dataclass(frozen=True, slots=True)
class FaceReport:
    """How far one face of the library got in one frame: what `detect --explain` prints.

    Attributes:
        object: name of the object.
        face: name of the face.
        instance: 0 for the first attempt, 1 for the search after the first instance, …
        found: whether the face was accepted.
        stage: where it stopped: "features", "proposal" (in a large library), "matching",
            "homography", "verification", or "found".
        reason: the check that refused it, in words with its numbers; "" where found.
        figures: the numbers by name, for example matches, inliers, area_px.
    """

    object: str
    face: str
    instance: int
    found: bool
    stage: str
    reason: str
    figures: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class DetectionReport:
    """Detections of one frame together with the fate of every face of the library."""

    detections: tuple[Detection, ...]
    faces: tuple[FaceReport, ...]
    seconds: Mapping[str, float]
