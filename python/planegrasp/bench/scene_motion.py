"""How the camera moved, by everything in view that stands still: a check of a recorded truth.

Points of one frame that have depth, outside of the objects, are the landmarks. In another frame the
pose that reprojects them best is the motion of the camera since (perspective-n-point inside of
RANSAC). They spread over the whole image and over all distances, so that the motion is well
determined where that against one flat board of markers is not. Features, matching and pose are
OpenCV's: nothing of what is measured takes part.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.geometry import RigidTransform, Rotation

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.rgbd import RGBDFrame

__all__ = ["Landmarks", "camera_motion", "landmarks"]

_MOST_FEATURES = 4000
_CONTRAST = 0.02
_RATIO = 0.8
# The outlines of the objects are enlarged by this factor: their own features must not take part.
_MARGIN = 1.2
# A landmark has depth in most of its window, and no edge in it: its depth is the window's median.
_WINDOW = 5
_SMALLEST_SHARE = 0.6
_LARGEST_STEP = 0.05
# Beyond this, depth cameras of short range say little.
_FARTHEST = 3.0
_RANSAC_PX = 3.0
_RANSAC_ITERATIONS = 2000
_INLIER_PX = 2.0
_FEWEST_INLIERS = 30


@dataclass(frozen=True, slots=True, eq=False)
class Landmarks:
    """Points that stand still.

    Attributes:
        points: N×3 in the frame of the camera that saw them first [m].
        descriptors: N×128.
    """

    points: NDArray[np.float64]
    descriptors: NDArray[np.float32]


def landmarks(frame: RGBDFrame, objects: Iterable[NDArray[np.float64]]) -> Landmarks:
    """The features of a frame that have depth and lie outside of the objects.

    Args:
        frame: colour with depth; without depth there are no landmarks.
        objects: outline of each object that may move or is measured, N×2 pixels.
    """
    pixels, descriptors = _features(frame)
    z = _depths(frame, pixels)
    outside = np.ones(len(pixels), bool)
    for outline in objects:
        hull = cv2.convexHull(np.asarray(outline, dtype=np.float32))[:, 0]
        centre = hull.mean(axis=0)
        enlarged = (centre + _MARGIN * (hull - centre)).astype(np.float32)
        outside &= [cv2.pointPolygonTest(enlarged, (u, v), False) < 0 for u, v in pixels.tolist()]
    chosen = outside & (z > 0)
    points = frame.camera.rays(pixels[chosen]) * z[chosen, None]
    return Landmarks(points, descriptors[chosen])


def camera_motion(seen: Landmarks, frame: RGBDFrame) -> RigidTransform | None:
    """T_camera_first: the pose in a frame of the camera that saw the landmarks first.

    Returns:
        The pose, or None where fewer than 30 landmarks are seen again.
    """
    pixels, descriptors = _features(frame)
    if len(seen.points) < _FEWEST_INLIERS or len(pixels) < _FEWEST_INLIERS:
        return None
    matches = cv2.BFMatcher(cv2.NORM_L2).knnMatch(seen.descriptors, descriptors, 2)
    good = [first for first, second in matches if first.distance < _RATIO * second.distance]
    points = seen.points[[match.queryIdx for match in good]]
    image = frame.camera.undistort(pixels[[match.trainIdx for match in good]])
    return _pose(points, image, frame.camera)


def _features(frame: RGBDFrame) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Pixels (N×2) and descriptors (N×128)."""
    gray = cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY)
    sift = cv2.SIFT.create(_MOST_FEATURES, contrastThreshold=_CONTRAST)
    keypoints, descriptors = sift.detectAndCompute(gray, None)
    if descriptors is None:
        return np.zeros((0, 2)), np.zeros((0, 128), np.float32)
    return np.array([keypoint.pt for keypoint in keypoints]), descriptors.astype(np.float32)


def _depths(frame: RGBDFrame, pixels: NDArray[np.float64]) -> NDArray[np.float64]:
    """Depth at each pixel [m]; 0 where it is missing, at an edge, or too far."""
    z = np.zeros(len(pixels))
    if frame.depth is None:
        return z
    height, width = frame.depth.shape
    reach = _WINDOW // 2
    for i, (u, v) in enumerate(np.rint(pixels).astype(int)):
        if not (reach <= u < width - reach and reach <= v < height - reach):
            continue
        window = frame.depth[v - reach : v + reach + 1, u - reach : u + reach + 1]
        measured = window[window > 0]
        if len(measured) < _SMALLEST_SHARE * window.size:
            continue
        median = float(np.median(measured))
        if median <= _FARTHEST and np.ptp(measured) <= _LARGEST_STEP * median:
            z[i] = median
    return z


def _pose(
    points: NDArray[np.float64], image: NDArray[np.float64], camera: PinholeCamera
) -> RigidTransform | None:
    """Robust pose of points [m] that are seen at undistorted pixels."""
    if len(points) < _FEWEST_INLIERS:
        return None
    found, rotation, translation, inliers = cv2.solvePnPRansac(
        points,
        image,
        camera.matrix,
        None,
        iterationsCount=_RANSAC_ITERATIONS,
        reprojectionError=_RANSAC_PX,
        flags=cv2.SOLVEPNP_EPNP,
    )
    if not found:
        return None
    chosen = np.zeros(len(points), bool)
    chosen[inliers.ravel()] = True
    for _ in range(3):
        if np.count_nonzero(chosen) < _FEWEST_INLIERS:
            return None
        rotation, translation = cv2.solvePnPRefineLM(
            points[chosen], image[chosen], camera.matrix, None, rotation, translation
        )
        projected, _ = cv2.projectPoints(points, rotation, translation, camera.matrix, None)
        chosen = np.linalg.norm(projected[:, 0] - image, axis=1) < _INLIER_PX
    return RigidTransform.from_components(
        translation.ravel(), Rotation.from_rotvec(rotation.ravel())
    )
