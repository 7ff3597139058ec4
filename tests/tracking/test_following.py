"""One step from a predicted pose to the pose that a frame shows."""

from __future__ import annotations

import numpy as np
import pytest
from moving import frames, swaying

from planegrasp import _core
from planegrasp._convert import to_core_camera
from planegrasp.bench.scenes import CAMERA, photograph, random_pose
from planegrasp.bench.textures import random_background
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.rgbd import RGBDFrame
from planegrasp.tracking import FollowConfig, Follower


@pytest.fixture(scope="module")
def coffee():
    return photograph("coffee")


def test_several_are_followed_as_each_alone(coffee):
    """In threads of their own, and with the same result."""
    (frame, truth), _ = frames(coffee, swaying, 2)
    beside = [
        truth * RigidTransform.from_components([dx, 0.0, 0.0], Rotation.identity())
        for dx in (0.0, 0.002, 0.004)
    ]
    follower = Follower()
    together = follower.follow([(coffee, i, T.as_matrix()) for i, T in enumerate(beside)], frame)
    for i, T in enumerate(beside):
        (alone,) = follower.follow([(coffee, i, T.as_matrix())], frame)
        assert together[i].instance == i
        np.testing.assert_array_equal(
            together[i].T_camera_object.as_matrix(), alone.T_camera_object.as_matrix()
        )


def test_nothing_is_seen_in_other_pictures():
    """Poses at random before photographs of something else: chance alone agrees by a fifth."""
    rng = np.random.default_rng(4)
    models = [photograph(name) for name in ("astronaut", "coffee", "chelsea", "retina")]
    follower, reasons = Follower(), []
    for _ in range(12):
        background = random_background(rng)
        rows, columns = np.arange(480) % len(background), np.arange(640) % background.shape[1]
        color = np.ascontiguousarray(background[rows][:, columns])
        frame = RGBDFrame(color, np.full((480, 640), 0.7, np.float32), CAMERA)
        predicted = [
            (m, 0, random_pose(rng, np.radians(rng.uniform(0, 70))).as_matrix()) for m in models
        ]
        reasons += follower.follow(predicted, frame)
    assert len(reasons) == 48
    assert all(isinstance(reason, str) for reason in reasons)


def test_without_depth_there_is_a_pose_too(coffee):
    (frame, truth), _ = frames(coffee, swaying, 2)
    flat = RGBDFrame(frame.color, None, frame.camera)
    (found,) = Follower().follow([(coffee, 0, truth.as_matrix())], flat)
    assert found.pose.depth_pixels == 0
    assert np.linalg.norm(found.T_camera_object.translation - truth.translation) < 2e-3


def test_what_a_face_shows_is_what_the_detection_says(coffee):
    (frame, truth), _ = frames(coffee, swaying, 2)
    (found,) = Follower().follow([(coffee, 3, truth.as_matrix())], frame)
    (face,) = found.faces
    assert found.instance == 3
    assert found.tracked
    assert face.agreement > 0.9
    assert 0.4 < face.coverage <= 1.0
    height, width = coffee.faces[0].image.shape[:2]
    assert np.all((face.reference_points > 0) & (face.reference_points < [width, height]))


def test_no_objects_are_no_work(coffee):
    (frame, _), _ = frames(coffee, swaying, 2)
    assert Follower().follow([], frame) == []


def test_settings_without_meaning_are_refused():
    with pytest.raises(InvalidInputError, match=r"min_share must be 0 … 1, not 1, got 1\.5"):
        FollowConfig(min_share=1.5)
    with pytest.raises(InvalidInputError, match="must be numbers"):
        FollowConfig(min_side="wide")


@pytest.mark.parametrize(
    ("poses", "size", "message"),
    [
        ([np.eye(4)], (240, 320), "480"),
        ([np.eye(4), np.eye(4)], (480, 640), "one predicted pose an object, got 2 for 1"),
        ([np.eye(3)], (480, 640), "predicted must be 4×4"),
        ([np.diag([2.0, 1.0, 1.0, 1.0])], (480, 640), "predicted"),
        ([np.full((4, 4), np.nan)], (480, 640), "predicted"),
    ],
)
def test_what_the_core_cannot_work_with_is_an_error(poses, size, message):
    core = _core.Follower(FollowConfig()._settings())
    camera = to_core_camera(CAMERA)
    gray = np.zeros(size, np.uint8)
    with pytest.raises(InvalidInputError, match=message):
        core.follow([_core.TrackedObject()], poses, gray, None, camera)


def test_an_object_without_faces_is_not_seen():
    core = _core.Follower(FollowConfig()._settings())
    gray = np.zeros((480, 640), np.uint8)
    (reason,) = core.follow(
        [_core.TrackedObject()], [np.eye(4)], gray, None, to_core_camera(CAMERA)
    )
    assert reason == "no face is turned towards the camera"
