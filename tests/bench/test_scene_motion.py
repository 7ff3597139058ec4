"""The motion of the camera, from what stands still beside the objects."""

from dataclasses import replace

import numpy as np
import pytest

from planegrasp.bench.scene_motion import camera_motion, landmarks
from planegrasp.bench.scenes import CAMERA, facing_pose
from planegrasp.bench.textures import background, texture
from planegrasp.geometry import RigidTransform, Rotation, rotation_angle
from planegrasp.simulation import Rectangle, render

# Three pictures that hang at different distances and tilts, and the object in front of them.
STILL = (
    ("gravel", 0.5, [-0.25, -0.1, 0.9], 0.5),
    ("coins", 0.5, [0.3, -0.15, 1.1], 0.3),
    ("motorcycle_left", 0.6, [0.05, 0.25, 1.3], 0.2),
)
T_FIRST_OBJECT = facing_pose(np.array([0.0, 0.05, 0.6]), 0.4, 1.0, 0.1)


def shown(T_camera_first, T_first_object, seed, still=STILL):
    """The frame of a camera that moved, before an object that may have moved."""
    things = [Rectangle(texture("astronaut"), 0.15, 0.15, T_camera_first * T_first_object)]
    for i, (name, width, position, tilt) in enumerate(still):
        image = background(name)
        image = np.stack([image] * 3, axis=-1) if image.ndim == 2 else image
        height = width * image.shape[0] / image.shape[1]
        T_first_picture = facing_pose(np.array(position), tilt, 2.0 * i, 0.0)
        things.append(Rectangle(image, width, height, T_camera_first * T_first_picture))
    return render(things, CAMERA, np.random.default_rng(seed))


@pytest.fixture(scope="module")
def first():
    return shown(RigidTransform.identity(), T_FIRST_OBJECT, 0)


def test_the_motion_is_that_of_the_camera_although_the_object_moves(first):
    turned = Rotation.from_rotvec(np.radians([3.0, -4.0, 6.0]))
    T_camera_first = RigidTransform.from_components([0.04, -0.03, 0.02], turned)
    moved = RigidTransform.from_translation([0.03, 0.02, -0.02]) * T_FIRST_OBJECT
    found = camera_motion(
        landmarks(first.frame, [first.corners[0]]), shown(T_camera_first, moved, 1).frame
    )
    # Hundreds of points with about half a pixel of noise at one metre, over 30° of the view.
    angle = np.degrees(rotation_angle(found.rotation, T_camera_first.rotation))
    assert angle < 0.1
    assert np.linalg.norm(found.translation - T_camera_first.translation) < 2e-3


def test_no_landmark_lies_on_an_object(first):
    everywhere = landmarks(first.frame, [])
    outside = landmarks(first.frame, [first.corners[0]])
    # The object is the only thing nearer than 0.68 m.
    assert np.any(everywhere.points[:, 2] < 0.68)
    assert not np.any(outside.points[:, 2] < 0.68)
    assert len(outside.descriptors) == len(outside.points) > 100


def test_landmarks_lie_where_the_depth_truly_is(first):
    seen = landmarks(first.frame, [first.corners[0]])
    u, v = np.rint(CAMERA.project(seen.points)).astype(int).T
    # The Kinect's noise and steps are below 1 % here, and the median over 25 pixels is better.
    assert seen.points[:, 2] == pytest.approx(first.true_depth[v, u], rel=0.01)


def test_another_scene_gives_no_motion(first):
    other = (("brick", 0.9, [0.0, 0.0, 1.0], 0.1),)
    frame = shown(RigidTransform.identity(), T_FIRST_OBJECT, 1, still=other).frame
    assert camera_motion(landmarks(first.frame, [first.corners[0]]), frame) is None


def test_without_depth_or_features_there_is_nothing_to_go_by(first):
    assert len(landmarks(replace(first.frame, depth=None), []).points) == 0
    blank = replace(first.frame, color=np.full_like(first.frame.color, 128))
    assert len(landmarks(blank, []).points) == 0
    assert camera_motion(landmarks(blank, []), first.frame) is None
    assert camera_motion(landmarks(first.frame, []), blank) is None
