"""What one would put together from OpenCV's parts: the peer that speed is measured against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.homography import apply_homography, reference_corners
from planegrasp.stopwatch import StopWatch

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.features import Extractor, Features
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

# As `DetectorConfig` and `HomographyConfig` have them.
_RATIO, _THRESHOLD, _MIN_MATCHES, _REFERENCE_SIDE = 0.8, 3.0, 10, 400
_FLANN = {"algorithm": 1, "trees": 4}
_CHECKS = 64


@dataclass(frozen=True, slots=True, eq=False)
class OpenCVResult:
    """One frame.

    Attributes:
        keypoints: of the frame.
        seconds: that each stage took.
        corners: 4×2 of the face [px], None where no homography was found.
        T_camera_object: 4×4, None where there is no pose.
    """

    keypoints: int
    seconds: dict[str, float]
    corners: NDArray[np.float64] | None
    T_camera_object: NDArray[np.float64] | None


class OpenCVPipeline:
    """FLANN's k-d trees, the ratio test, RANSAC and solvePnP for one one-face object.

    No oblique views, no depth, no verification, as in OpenCV's own samples: less work than
    the detector does.
    """

    def __init__(self, model: ObjectModel, extractor: Extractor) -> None:
        self._extractor = extractor
        self._face = model.faces[0]
        gray = cv2.cvtColor(self._face.image, cv2.COLOR_RGB2GRAY)
        self._scale = max(1.0, max(gray.shape) / _REFERENCE_SIDE)
        small = cv2.resize(
            gray, None, fx=1 / self._scale, fy=1 / self._scale, interpolation=cv2.INTER_AREA
        )
        self._reference = extractor.extract(small.astype(np.uint8))
        self._index = cv2.flann.Index(self._reference.descriptors, dict(_FLANN), 1)

    def detect(self, frame: RGBDFrame) -> OpenCVResult:
        """Look for the face in a frame without lens distortion."""
        watch = StopWatch()
        gray = cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY).astype(np.uint8)
        features = self._extractor.extract(gray)
        watch.lap("extract")
        source, target = self._matches(features)
        watch.lap("match")
        matrix = None
        if len(source) >= _MIN_MATCHES:
            matrix, _ = cv2.findHomography(
                source, target, cv2.RANSAC, _THRESHOLD, maxIters=5000, confidence=0.9999
            )
        watch.lap("homography")
        corners = None if matrix is None else self._corners(np.asarray(matrix, dtype=np.float64))
        T_camera_object = None if corners is None else self._pose(corners, frame)
        watch.lap("pose")
        return OpenCVResult(len(features), watch.seconds, corners, T_camera_object)

    def _matches(self, features: Features) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Reference points (edge coordinates) and frame points that pass the ratio test."""
        if len(features) < 1 or len(self._reference) < 2:
            return np.zeros((0, 2), np.float32), np.zeros((0, 2), np.float32)
        indices, squared = self._index.knnSearch(
            features.descriptors, 2, params={"checks": _CHECKS}
        )
        found = np.asarray(squared)
        keep = found[:, 0] < _RATIO**2 * found[:, 1]
        points = self._reference.points[np.asarray(indices)[keep, 0]]
        return ((points + 0.5) * self._scale).astype(np.float32), features.points[keep]

    def _corners(self, matrix: NDArray[np.float64]) -> NDArray[np.float64] | None:
        height, width = self._face.image.shape[:2]
        corners = apply_homography(matrix, reference_corners(width, height))
        return corners if np.all(np.isfinite(corners)) else None

    def _pose(self, corners: NDArray[np.float64], frame: RGBDFrame) -> NDArray[np.float64] | None:
        # OpenCV takes C-contiguous points only.
        object_points = np.ascontiguousarray(self._face.object_corners)
        good, rotation, translation = cv2.solvePnP(
            object_points,
            np.ascontiguousarray(corners),
            frame.camera.matrix,
            None,
            flags=cv2.SOLVEPNP_IPPE,
        )
        if not good:
            return None
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = cv2.Rodrigues(rotation)[0], np.ravel(translation)
        return T
