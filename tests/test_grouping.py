import numpy as np
import pytest

from planegrasp.bench.scenes import CAMERA
from planegrasp.detection import FaceDetection
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.grouping import group_faces, observe, predicted_homography
from planegrasp.homography import apply_homography, reference_corners
from planegrasp.objects import ObjectModel
from planegrasp.pose import make_pose_estimator
from planegrasp.references import FaceReference
from planegrasp.rgbd import RGBDFrame

SIZE = (0.2, 0.15, 0.12)
FRONT = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
FRAME = RGBDFrame(np.zeros((480, 640, 3), np.uint8), None, CAMERA)


def box():
    images = {
        "front": np.zeros((150, 200, 3), np.uint8),
        "right": np.zeros((150, 120, 3), np.uint8),
        "back": np.zeros((150, 200, 3), np.uint8),
    }
    return ObjectModel.box("carton", SIZE, images)


def reference(model, name):
    # Descriptors take no part in grouping.
    return FaceReference(model, model.face(name))


def pose(x=0.0, turn=40.0, z=0.6):
    return RigidTransform.from_components(
        [x, 0.01, z], Rotation.from_euler("y", turn, degrees=True) * FRONT
    )


def found(model, name, T, *, count=25, seed=0):
    """A face as it would be found, with exact inliers."""
    face = reference(model, name)
    H = predicted_homography(face, T, CAMERA)
    corners = apply_homography(H, reference_corners(*face.size))
    points = np.random.default_rng(seed).uniform((0, 0), face.size, (count, 2))
    return face, FaceDetection(name, H, H, corners, points, apply_homography(H, points), 0.8, 0.9)


def names(groups):
    return [sorted(d.name for _, d in group) for group in groups]


@pytest.mark.parametrize("name", ["front", "right"])
def test_a_pose_puts_the_corners_of_a_face_where_the_camera_sees_them(name):
    model, T = box(), pose()
    H = predicted_homography(reference(model, name), T, CAMERA)
    face = model.face(name)
    expected = CAMERA.project(T.apply(face.object_corners))
    np.testing.assert_allclose(apply_homography(H, face.edge_corners), expected, atol=1e-9)


def test_the_prediction_is_in_undistorted_pixels():
    lens = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5, (0.1, -0.2))
    face = reference(box(), "front")
    np.testing.assert_allclose(
        predicted_homography(face, pose(), lens), predicted_homography(face, pose(), CAMERA)
    )


def test_a_face_that_is_turned_away_is_not_predicted():
    model = box()
    assert predicted_homography(reference(model, "back"), pose(), CAMERA) is None
    assert predicted_homography(reference(model, "right"), pose(turn=0.0), CAMERA) is None


def test_observed_points_are_metres_on_the_face():
    face, detection = found(box(), "right", pose())
    observation = observe(face, detection)
    assert (observation.width, observation.height) == (SIZE[2], SIZE[1])
    assert np.all(np.abs(observation.face_points) <= (SIZE[2] / 2, SIZE[1] / 2))
    on_object = observation.T_object_face.apply(np.pad(observation.face_points, ((0, 0), (0, 1))))
    np.testing.assert_allclose(
        CAMERA.project(pose().apply(on_object)), observation.image_points, atol=1e-6
    )
    np.testing.assert_allclose(
        apply_homography(observation.homography, observation.face_points),
        observation.image_points,
        atol=1e-6,
    )


def test_faces_of_one_box_belong_together():
    model = box()
    faces = [found(model, "front", pose()), found(model, "right", pose(), count=20)]
    assert names(group_faces(faces, make_pose_estimator(), FRAME)) == [["front", "right"]]


def test_faces_of_two_boxes_do_not():
    model, left, right = box(), pose(-0.15), pose(0.2)
    faces = [found(model, "front", left), found(model, "right", right, count=20)]
    assert names(group_faces(faces, make_pose_estimator(), FRAME)) == [["front"], ["right"]]


def test_each_face_goes_to_the_box_that_it_is_of():
    model, left, right = box(), pose(-0.15), pose(0.2)
    faces = [
        found(model, "right", right, count=20),
        found(model, "front", left, count=30),
        found(model, "right", left, count=19),
        found(model, "front", right, count=29),
    ]
    groups = group_faces(faces, make_pose_estimator(), FRAME)
    assert names(groups) == [["front", "right"]] * 2
    for group in groups:
        middle = [d.corners[:, 0].mean() for _, d in group]
        assert abs(middle[0] - middle[1]) < 150  # of the same box, not of the one beside it


def test_the_same_face_twice_is_two_boxes():
    model = box()
    faces = [found(model, "front", pose(), count=30), found(model, "front", pose(), count=20)]
    assert names(group_faces(faces, make_pose_estimator(), FRAME)) == [["front"], ["front"]]


def test_without_a_pose_faces_stay_by_themselves():
    model = box()
    faces = [found(model, "front", pose()), found(model, "right", pose(), count=20)]
    no_depth_no_pose = make_pose_estimator("three_point")
    assert len(group_faces(faces, no_depth_no_pose, FRAME)) == 2
