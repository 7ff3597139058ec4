"""The motion of the camera, from what stands still beside the objects."""

from dataclasses import replace

import numpy as np
import pytest

from planegrasp.bench.scene_lens import calibrate_lens
from planegrasp.bench.scene_motion import camera_motion, landmarks, sightings
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


def shown(T_camera_first, T_first_object, seed, still=STILL, camera=CAMERA):
    """The frame of a camera that moved, before an object that may have moved."""
    things = [Rectangle(texture("astronaut"), 0.15, 0.15, T_camera_first * T_first_object)]
    for i, (name, width, position, tilt) in enumerate(still):
        image = background(name)
        image = np.stack([image] * 3, axis=-1) if image.ndim == 2 else image
        height = width * image.shape[0] / image.shape[1]
        T_first_picture = facing_pose(np.array(position), tilt, 2.0 * i, 0.0)
        things.append(Rectangle(image, width, height, T_camera_first * T_first_picture))
    return render(things, camera, np.random.default_rng(seed))


def motion(first, frame):
    """From a first frame to another one, whatever the object does."""
    seen = landmarks(first.frame, [first.corners[0]])
    return camera_motion(seen, sightings(seen, frame), frame.camera)


@pytest.fixture(scope="module")
def first():
    return shown(RigidTransform.identity(), T_FIRST_OBJECT, 0)


def test_the_motion_is_that_of_the_camera_although_the_object_moves(first):
    turned = Rotation.from_rotvec(np.radians([3.0, -4.0, 6.0]))
    T_camera_first = RigidTransform.from_components([0.04, -0.03, 0.02], turned)
    moved = RigidTransform.from_translation([0.03, 0.02, -0.02]) * T_FIRST_OBJECT
    found = motion(first, shown(T_camera_first, moved, 1).frame)
    # Hundreds of points with about half a pixel of noise at one metre, over 30° of the view.
    angle = np.degrees(rotation_angle(found.rotation, T_camera_first.rotation))
    assert angle < 0.1
    assert np.linalg.norm(found.translation - T_camera_first.translation) < 2e-3


def test_no_landmark_lies_on_an_object(first):
    everywhere = landmarks(first.frame, [])
    outside = landmarks(first.frame, [first.corners[0]])
    # The object is the only thing nearer than 0.68 m.
    assert np.any(everywhere.depth < 0.68)
    assert not np.any(outside.depth < 0.68)
    assert len(outside.descriptors) == len(outside.depth) > 100


def test_landmarks_lie_where_the_depth_truly_is(first):
    seen = landmarks(first.frame, [first.corners[0]])
    points = seen.points(CAMERA)
    u, v = np.rint(CAMERA.project(points)).astype(int).T
    # The Kinect's noise and steps are below 1 % here, and the median over 25 pixels is better.
    assert points[:, 2] == pytest.approx(first.true_depth[v, u], rel=0.01)


def test_another_scene_gives_no_motion(first):
    other = (("brick", 0.9, [0.0, 0.0, 1.0], 0.1),)
    frame = shown(RigidTransform.identity(), T_FIRST_OBJECT, 1, still=other).frame
    assert motion(first, frame) is None


def test_without_depth_or_features_there_is_nothing_to_go_by(first):
    assert len(landmarks(replace(first.frame, depth=None), []).depth) == 0
    blank = replace(first.frame, color=np.full_like(first.frame.color, 128))
    seen = landmarks(blank, [])
    assert len(seen.depth) == 0
    assert camera_motion(seen, sightings(seen, first.frame), CAMERA) is None
    assert motion(first, blank) is None


LENS = replace(CAMERA, distortion=(0.15, -0.3))


def moving(camera):
    """Landmarks of a first frame, and what frames with other views see of them."""
    first = shown(RigidTransform.identity(), T_FIRST_OBJECT, 0, camera=camera)
    seen = landmarks(first.frame, [first.corners[0]])
    views = []
    for i, (turn, at) in enumerate(
        [
            ([8.0, 0.0, 0.0], [0.0, 0.1, 0.0]),
            ([0.0, -8.0, 20.0], [0.1, 0.0, 0.0]),
            ([-8.0, 4.0, -30.0], [0.0, -0.1, 0.05]),
        ]
    ):
        T = RigidTransform.from_components(at, Rotation.from_rotvec(np.radians(turn)))
        views.append(sightings(seen, shown(T, T_FIRST_OBJECT, i + 1, camera=camera).frame))
    return seen, views


def test_the_lens_is_found_where_the_camera_file_has_none():
    seen, views = moving(LENS)
    found = calibrate_lens(seen, views, CAMERA)
    grid = np.stack(np.meshgrid(np.linspace(20, 620, 13), np.linspace(20, 460, 10)), axis=-1)
    pixels = grid.reshape(-1, 2)
    true = LENS.undistort(pixels) - pixels
    error = found.undistort(pixels) - LENS.undistort(pixels)
    # The lens moves the image's border by pixels; what is left is below the noise of a feature.
    assert np.linalg.norm(true, axis=1).max() > 3.0
    assert np.sqrt(np.mean(error**2)) < 0.5


def test_a_camera_without_distortion_stays_nearly_so_and_a_calibrated_one_as_it_is():
    seen, views = moving(CAMERA)
    found = calibrate_lens(seen, views, CAMERA)
    corners = np.array([[0.0, 0.0], [639.0, 479.0], [0.0, 479.0]])
    assert np.linalg.norm(found.undistort(corners) - corners, axis=1).max() < 1.5
    assert calibrate_lens(seen, views, LENS) is LENS
    assert calibrate_lens(seen, [], CAMERA) is CAMERA
