"""Where the parts of a drawing lie in the image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.detection import Detection, FaceDetection
    from planegrasp.geometry import PinholeCamera

    Float64Array = NDArray[np.float64]


def face_outline(face: FaceDetection, camera: PinholeCamera, samples: int = 16) -> Float64Array:
    """The closed outline of a face in the image as the lens bends it.

    Args:
        face: the detection.
        camera: that took the frame.
        samples: points per edge where the camera is distorted; straight edges need one.

    Returns:
        N×2 pixels, clockwise from the top-left corner.
    """
    if not camera.is_distorted:
        return np.asarray(face.corners, dtype=np.float64)
    corners = _to_reference(face, camera)
    steps = np.linspace(0.0, 1.0, samples, endpoint=False)[:, None]
    edges = [a + steps * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
    return camera.distort(_apply(face.homography, np.vstack(edges)))


def face_size(detection: Detection, camera: PinholeCamera) -> tuple[float, float]:
    """Width and height [m] of the best supported face, as its image and the object's pose tell.

    A homography tells the size of what it shows up to the scale of the scene, K⁻¹·H ~ [r₁ r₂ t];
    the distance of the pose supplies the scale. This is exact for a face whose centre is the
    object's origin, and near enough to size a drawing for a face of a box.

    Raises:
        ValueError: the detection has no pose.
    """
    if detection.pose is None:
        raise ValueError("the size of a detection without a pose is not known")
    face = detection.faces[0]
    top_left, top_right, _, bottom_left = _to_reference(face, camera)
    width_px = float(np.linalg.norm(top_right - top_left))
    height_px = float(np.linalg.norm(bottom_left - top_left))
    M = np.linalg.solve(camera.matrix, face.homography)
    unit = float(np.linalg.norm(M[:, 0]) + np.linalg.norm(M[:, 1])) / 2
    center = (top_right + bottom_left) / 2
    distance_px = abs(float(M[2] @ (*center, 1.0))) / unit
    metres_per_px = float(detection.pose.T_camera_object.translation[2]) / distance_px
    return width_px * metres_per_px, height_px * metres_per_px


def axis_ends(detection: Detection, camera: PinholeCamera, length: float) -> Float64Array | None:
    """Pixels of the object's origin and of the ends of its x, y and z axis.

    Args:
        detection: of the object.
        camera: that took the frame.
        length: of the axes [m].

    Returns:
        4×2 pixels, or None without a pose or with an axis that reaches behind the camera.
    """
    if detection.pose is None:
        return None
    ends = np.vstack([np.zeros(3), length * np.eye(3)])
    points = np.asarray(detection.pose.T_camera_object.apply(ends))
    return camera.project(points) if np.all(points[:, 2] > 1e-3) else None


def _to_reference(face: FaceDetection, camera: PinholeCamera) -> Float64Array:
    """The face's four corners in edge coordinates of its reference image."""
    inverse: Float64Array = np.asarray(np.linalg.inv(face.homography), dtype=np.float64)
    return _apply(inverse, camera.undistort(face.corners))


def _apply(H: Float64Array, points: Float64Array) -> Float64Array:
    mapped = np.column_stack([points, np.ones(len(points))]) @ H.T
    return np.asarray(mapped[:, :2] / mapped[:, 2:], dtype=np.float64)
