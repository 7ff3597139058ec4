"""Detections as plain dictionaries: the one description behind `--json` and JSON Lines.

    frame        name of the frame
    timestamp    seconds, or null
    detections   one entry for each found object:
        name, instance            as in `Detection`
        tracked                   whether it was followed from the frame before
        score                     0 … 1
        inliers                   of all faces together
        corners                   4×2 pixels of the best supported face: top-left, top-right,
                                  bottom-right, bottom-left of its reference image
        homography                3×3 of that face, see `FaceDetection.homography`
        faces                     every found face: name, inliers, coverage, agreement, corners,
                                  homography
        T_camera_object           4×4, metres; null (as all that follows) without a pose
        translation               x, y, z of T_camera_object [m]
        quaternion                x, y, z, w of T_camera_object, w ≥ 0
        euler                     roll, pitch, yaw (φ, θ, ψ) of T_camera_object [rad]
        covariance                6×6 of (translation, rotation vector) in the object's frame, or
                                  null where the method gives none
        ambiguous                 whether `alternative` explains the evidence about as well
        alternative               4×4 of the other planar solution, or null
        reprojection_rms          of the inliers [px]
        depth_pixels              how many depth measurements took part
        pose_failure              why there is no pose, or ""

Numbers that are not finite become null, so that every JSON reader takes the result.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from planegrasp.detection import Detection, FaceDetection, FaceReport
    from planegrasp.geometry import RigidTransform
    from planegrasp.rgbd import RGBDFrame


def frame_to_dict(frame: RGBDFrame, detections: Sequence[Detection]) -> dict[str, Any]:
    """The detections of one frame, ready for `json.dumps`; keys as in this module's docstring."""
    return {
        "frame": frame.name,
        "timestamp": frame.timestamp,
        "detections": [detection_to_dict(detection) for detection in detections],
    }


def detection_to_dict(detection: Detection) -> dict[str, Any]:
    """One detection, ready for `json.dumps`; keys as in this module's docstring."""
    return {
        "name": detection.name,
        "instance": detection.instance,
        "tracked": detection.tracked,
        "score": _number(detection.score),
        "inliers": detection.inliers,
        "corners": _numbers(detection.corners),
        "homography": _numbers(detection.homography),
        "faces": [_face(face) for face in detection.faces],
        **_pose(detection),
        "pose_failure": detection.pose_failure,
    }


def face_report_to_dict(report: FaceReport) -> dict[str, Any]:
    """How far one face got, ready for `json.dumps`: the fields of `FaceReport` by name."""
    return {
        "object": report.object,
        "face": report.face,
        "instance": report.instance,
        "found": report.found,
        "stage": report.stage,
        "reason": report.reason,
        "figures": {name: _number(value) for name, value in report.figures.items()},
    }


def _face(face: FaceDetection) -> dict[str, Any]:
    return {
        "name": face.name,
        "inliers": face.inliers,
        "coverage": _number(face.coverage),
        "agreement": _number(face.agreement),
        "corners": _numbers(face.corners),
        "homography": _numbers(face.homography),
    }


def _pose(detection: Detection) -> dict[str, Any]:
    pose = detection.pose
    if pose is None:
        keys = (
            "T_camera_object",
            "translation",
            "quaternion",
            "euler",
            "covariance",
            "ambiguous",
            "alternative",
            "reprojection_rms",
            "depth_pixels",
        )
        return dict.fromkeys(keys)
    return {
        "T_camera_object": _matrix(pose.T_camera_object),
        "translation": _numbers(pose.T_camera_object.translation),
        "quaternion": _numbers(pose.T_camera_object.rotation.as_quat(canonical=True)),
        "euler": _numbers(detection.euler),
        "covariance": _numbers(pose.covariance),
        "ambiguous": pose.ambiguous,
        "alternative": _matrix(pose.alternative),
        "reprojection_rms": _number(pose.reprojection_rms),
        "depth_pixels": pose.depth_pixels,
    }


def _matrix(T: RigidTransform | None) -> Any:
    return None if T is None else _numbers(T.as_matrix())


def _numbers(values: ArrayLike | None) -> Any:
    """Nested lists of floats, None where a value is not finite."""
    if values is None:
        return None
    array = np.asarray(values, dtype=np.float64)
    if np.all(np.isfinite(array)):
        return array.tolist()
    cells = array.astype(object)
    cells[~np.isfinite(array)] = None
    return cells.tolist()


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
