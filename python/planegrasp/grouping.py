"""Which faces, found in one frame, belong to the same instance of an object."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import InvalidInputError, PoseError
from planegrasp.homography import apply_homography
from planegrasp.pose.base import FaceObservation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.detection import FaceDetection
    from planegrasp.geometry import PinholeCamera, RigidTransform
    from planegrasp.pose.base import PoseEstimator
    from planegrasp.references import FaceReference
    from planegrasp.rgbd import RGBDFrame

    Found = tuple[FaceReference, FaceDetection]

# Predicted and found corners of a face may differ by this share of the face's size in the image:
# a pose from one face alone is not exact where the other face is.
_TOLERANCE = 0.25
# Faces seen more obliquely than about 80° are not looked for.
_MIN_COSINE = 0.17


def observe(reference: FaceReference, detection: FaceDetection) -> FaceObservation:
    """The evidence for a pose that a found face gives.

    Keypoints are tenths of a pixel off, the alignment of the face's grey values some hundredths:
    where there is one, the inliers are taken to lie where it puts them.
    """
    face = reference.face
    image_points = detection.image_points
    if detection.is_aligned:
        image_points = apply_homography(detection.homography, detection.reference_points)
    return FaceObservation(
        T_object_face=face.T_object_face,
        width=face.width,
        height=face.height,
        face_points=apply_homography(face.face_from_edge, detection.reference_points),
        image_points=image_points,
        homography=detection.homography @ face.edge_from_face,
    )


def group_faces(faces: Sequence[Found], pose: PoseEstimator, frame: RGBDFrame) -> list[list[Found]]:
    """Put faces of one object together where the pose of one predicts the other.

    Args:
        faces: found faces of one object; the same face may occur several times (instances).
        pose: estimates the pose of a group from its best supported face.
        frame: in which they were found.

    Returns:
        One list of faces per instance; no face occurs twice in one list.
    """
    groups: list[list[Found]] = []
    for reference, detection in sorted(faces, key=lambda pair: -pair[1].inliers):
        for group in groups:
            known = any(other.name == detection.name for _, other in group)
            if not known and _predicts(group, (reference, detection), pose, frame):
                group.append((reference, detection))
                break
        else:
            groups.append([(reference, detection)])
    return groups


def predicted_homography(
    reference: FaceReference, T_camera_object: RigidTransform, camera: PinholeCamera
) -> NDArray[np.float64] | None:
    """Where a pose puts a face: reference edges to undistorted pixels; None if it faces away."""
    T_camera_face = T_camera_object * reference.face.T_object_face
    translation, rotation = T_camera_face.as_components()
    R = rotation.as_matrix()
    cosine = -float(R[:, 2] @ translation) / float(np.linalg.norm(translation))
    if cosine < _MIN_COSINE:
        return None
    plane = np.column_stack([R[:, 0], R[:, 1], translation])
    matrix = camera.matrix @ plane @ reference.face.face_from_edge
    return np.asarray(matrix / matrix[2, 2], dtype=np.float64)


def _predicts(
    group: Sequence[Found], candidate: Found, pose: PoseEstimator, frame: RGBDFrame
) -> bool:
    """Whether the group's pose puts the candidate's corners where they were found."""
    reference, detection = candidate
    try:
        estimate = pose.estimate([observe(r, f) for r, f in group], frame)
        corners = estimate.T_camera_object.apply(reference.face.object_corners)
        predicted = frame.camera.project(corners)
    except (PoseError, InvalidInputError):
        return False
    error = float(np.linalg.norm(predicted - detection.corners, axis=1).mean())
    sides = detection.corners - np.roll(detection.corners, 1, axis=0)
    return error <= _TOLERANCE * float(np.linalg.norm(sides, axis=1).max())
