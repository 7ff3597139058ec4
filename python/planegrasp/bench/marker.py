"""A fiducial marker as the peer of our pose: AprilTag 36h11 by OpenCV's ArUco module."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.simulation import Rectangle

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.rgbd import RGBDFrame

_DICTIONARY = cv2.aruco.DICT_APRILTAG_36h11
_IDENTIFIER = 7
# A 36h11 tag is 8 modules wide with its black border; one white module around it is its quiet zone.
_MODULES = 8
_MODULE_PIXELS = 64


def marker_rectangle(width: float, T_camera_marker: RigidTransform) -> Rectangle:
    """A printed tag whose black square has this width [m], with its quiet zone."""
    dictionary = cv2.aruco.getPredefinedDictionary(_DICTIONARY)
    side = _MODULES * _MODULE_PIXELS
    tag = cv2.aruco.generateImageMarker(dictionary, _IDENTIFIER, side)
    # Ink and paper, as a camera exposes them, are neither black nor white.
    with_zone = np.pad(tag, _MODULE_PIXELS, constant_values=255).astype(np.float64)
    gray = 30 + with_zone / 255 * (225 - 30)
    texture = np.repeat(gray[..., None], 3, axis=2).astype(np.uint8)
    outer = width * (_MODULES + 2) / _MODULES
    return Rectangle(texture, outer, outer, T_camera_marker)


def marker_pose(frame: RGBDFrame, width: float) -> RigidTransform | None:
    """The tag's pose from its four sub-pixel corners by IPPE; None if it is not found."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(_DICTIONARY), parameters)
    gray = cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY)
    corners, identifiers, _ = detector.detectMarkers(gray)
    if identifiers is None:
        return None
    for quad, identifier in zip(corners, identifiers.ravel(), strict=True):
        if identifier == _IDENTIFIER:
            return _square_pose(quad.reshape(4, 2).astype(np.float64), width, frame)
    return None


def _square_pose(
    corners: NDArray[np.float64], width: float, frame: RGBDFrame
) -> RigidTransform | None:
    half = width / 2
    square = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    found, rotations, translations, _ = cv2.solvePnPGeneric(
        square,
        corners,
        frame.camera.matrix,
        frame.camera.coefficients,
        flags=cv2.SOLVEPNP_IPPE_SQUARE,
    )
    if not found:
        return None
    rotation = Rotation.from_rotvec(np.asarray(rotations[0]).ravel())
    return RigidTransform.from_components(np.asarray(translations[0]).ravel(), rotation)
