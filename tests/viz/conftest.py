"""Detections made from exact geometry, without a detector."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from planegrasp.detection import Detection, FaceDetection
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.objects import ObjectModel
from planegrasp.pose.base import PoseEstimate
from planegrasp.rgbd import RGBDFrame

STRAIGHT = PinholeCamera(320, 240, 300.0, 302.0, 158.5, 121.0)
BENT = PinholeCamera(320, 240, 300.0, 302.0, 158.5, 121.0, (0.15, -0.2, 0.002, -0.001))
FACE_WIDTH, FACE_HEIGHT = 0.20, 0.14


@pytest.fixture(params=[STRAIGHT, BENT], ids=["straight", "bent"])
def camera(request) -> PinholeCamera:
    return request.param


@pytest.fixture
def frame(camera) -> RGBDFrame:
    color = np.full((camera.height, camera.width, 3), 90, np.uint8)
    depth = np.full((camera.height, camera.width), 0.8, np.float32)
    depth[:20] = 0
    return RGBDFrame(color, depth, camera, "a", 1.5)


@pytest.fixture
def detection(camera):
    """A function that makes the exact detection of a face of 0.20 × 0.14 m at a pose."""

    def make(
        name="book",
        translation=(0.03, -0.02, 0.7),
        degrees=(20.0, -25.0, 10.0),
        instance=0,
        with_pose=True,
    ):
        facing = Rotation.from_euler("x", np.pi)
        R = Rotation.from_euler("xyz", degrees, degrees=True) * facing
        T = RigidTransform.from_components(translation, R)
        x, y = FACE_WIDTH / 2, FACE_HEIGHT / 2
        points = np.array([[-x, y, 0], [x, y, 0], [x, -y, 0], [-x, -y, 0]])
        corners = camera.project(T.apply(points))
        edges = np.array([[0, 0], [400, 0], [400, 280], [0, 280]], np.float32)
        H = cv2.getPerspectiveTransform(edges, camera.undistort(corners).astype(np.float32))
        face = FaceDetection(
            "front", H / H[2, 2], H, corners, np.zeros((40, 2)), np.zeros((40, 2)), 0.7, 0.9
        )
        pose = PoseEstimate(T, 1e-6 * np.eye(6), False, None, 0.3, 1000) if with_pose else None
        failure = "" if with_pose else "no depth under the face"
        model = ObjectModel.from_image(name, np.zeros((280, 400, 3), np.uint8), FACE_WIDTH)
        return Detection(model, instance, (face,), 0.8, pose, failure)

    return make
