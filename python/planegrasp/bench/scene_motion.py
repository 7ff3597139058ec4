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

    Pose = tuple[NDArray[np.float64], NDArray[np.float64]]

__all__ = ["Landmarks", "Sightings", "camera_motion", "landmarks", "reproject", "sightings"]

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
    """Points that stand still, as one frame shows them.

    Attributes:
        pixels: N×2, as observed.
        depth: N along the optical axis [m].
        descriptors: N×128.
    """

    pixels: NDArray[np.float64]
    depth: NDArray[np.float64]
    descriptors: NDArray[np.float32]

    def points(self, camera: PinholeCamera) -> NDArray[np.float64]:
        """N×3 in the frame of the camera that saw them [m]."""
        return np.asarray(camera.rays(self.pixels) * self.depth[:, None], dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Landmarks that another frame shows again, some of them wrongly.

    Attributes:
        index: M, which landmark.
        pixels: M×2, as observed in that frame.
    """

    index: NDArray[np.intp]
    pixels: NDArray[np.float64]


def landmarks(frame: RGBDFrame, objects: Iterable[NDArray[np.float64]]) -> Landmarks:
    """The features of a frame that have depth and lie outside of the objects.

    Args:
        frame: colour with depth; without depth there are no landmarks.
        objects: outline of each object that may move or is measured, N×2 pixels.
    """
    pixels, descriptors = _features(frame)
    depth = _depths(frame, pixels)
    outside = np.ones(len(pixels), bool)
    for outline in objects:
        hull = cv2.convexHull(np.asarray(outline, dtype=np.float32))[:, 0]
        centre = hull.mean(axis=0)
        enlarged = (centre + _MARGIN * (hull - centre)).astype(np.float32)
        outside &= [cv2.pointPolygonTest(enlarged, (u, v), False) < 0 for u, v in pixels.tolist()]
    chosen = outside & (depth > 0)
    return Landmarks(pixels[chosen], depth[chosen], descriptors[chosen])


def sightings(seen: Landmarks, frame: RGBDFrame) -> Sightings:
    """The landmarks whose nearest descriptor in a frame passes the ratio test."""
    pixels, descriptors = _features(frame)
    if not len(seen.depth) or len(pixels) < 2:
        return Sightings(np.zeros(0, np.intp), np.zeros((0, 2)))
    matches = cv2.BFMatcher(cv2.NORM_L2).knnMatch(seen.descriptors, descriptors, 2)
    good = [first for first, second in matches if first.distance < _RATIO * second.distance]
    index = np.array([match.queryIdx for match in good], dtype=np.intp)
    return Sightings(index, pixels[[match.trainIdx for match in good]].reshape(-1, 2))


def camera_motion(
    seen: Landmarks, sighted: Sightings, camera: PinholeCamera
) -> RigidTransform | None:
    """T_camera_first: the pose of the camera that saw the landmarks first in that of a frame.

    Returns:
        The pose, or None where fewer than 30 landmarks agree on one.
    """
    if len(sighted.index) < _FEWEST_INLIERS:
        return None
    points = seen.points(camera)[sighted.index]
    image = camera.undistort(sighted.pixels)
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
    pose = (_floats(rotation), _floats(translation))
    for _ in range(3):
        if np.count_nonzero(chosen) < _FEWEST_INLIERS:
            return None
        pose, errors = reproject(points, image, camera, chosen, pose)
        chosen = errors < _INLIER_PX
    rotation, translation = pose
    return RigidTransform.from_components(
        translation.ravel(), Rotation.from_rotvec(rotation.ravel())
    )


def reproject(
    points: NDArray[np.float64],
    image: NDArray[np.float64],
    camera: PinholeCamera,
    chosen: NDArray[np.bool_],
    pose: Pose,
) -> tuple[Pose, NDArray[np.float64]]:
    """Refine a pose on the chosen points; then the error [px] of all of them.

    Args:
        points: N×3 [m].
        image: N×2 undistorted pixels.
        camera: of the image.
        chosen: N, at least six of them true.
        pose: rotation vector and translation [m] to start from, 3 each.

    Returns:
        The pose, 3×1 each, and N errors.
    """
    start_rotation, start_translation = (part.reshape(3, 1).copy() for part in pose)
    rotation, translation = cv2.solvePnPRefineLM(
        points[chosen],
        image[chosen],
        camera.matrix,
        None,
        start_rotation,
        start_translation,
    )
    projected, _ = cv2.projectPoints(points, rotation, translation, camera.matrix, None)
    errors = np.linalg.norm(projected[:, 0] - image, axis=1)
    return (_floats(rotation), _floats(translation)), errors


def _floats(values: object) -> NDArray[np.float64]:
    return np.asarray(values, dtype=np.float64)


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
