"""What the benchmarks call an error, a recall, a hidden share and a tilt, on cases made by hand."""

import math

import numpy as np
import pytest

from planegrasp.bench import textures, tilt
from planegrasp.bench.estimators import group_of
from planegrasp.bench.occlusion import occluder
from planegrasp.bench.pose import Trial as PoseTrial
from planegrasp.bench.pose import _medians
from planegrasp.bench.scenes import CAMERA, corner_error, facing_pose, photograph, random_pose
from planegrasp.bench.scenes import rectangles as rectangles_of
from planegrasp.detection import Detection, FaceDetection
from planegrasp.homography import apply_homography, reference_corners
from planegrasp.objects import ObjectModel, PlanarFace
from planegrasp.simulation import Rectangle, render


def rng(seed=0):
    return np.random.default_rng(seed)


def test_corner_error_is_the_mean_distance_of_the_corners():
    true = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    found = true + np.array([[3.0, 4.0], [0.0, 0.0], [0.0, -1.0], [2.0, 0.0]])
    assert corner_error(found, true) == pytest.approx((5 + 0 + 1 + 2) / 4)


def face_and_exact_homography(T_camera_face):
    face = PlanarFace("front", np.zeros((200, 300, 3), np.uint8), 0.3, 0.2)
    R, t = T_camera_face.rotation.as_matrix(), T_camera_face.translation
    H = CAMERA.matrix @ np.column_stack([R[:, 0], R[:, 1], t]) @ face.face_from_edge
    return face, H / H[2, 2]


def detection(H):
    nothing = np.zeros((0, 2))
    found = FaceDetection("front", H, H, np.zeros((4, 2)), nothing, nothing, 1.0, 1.0)
    thing = ObjectModel.from_image("thing", np.zeros((20, 20, 3), np.uint8), 0.2)
    return Detection(thing, 0, (found,), 1.0, None)


@pytest.mark.parametrize("degrees", [0, 40, 75])
def test_epsilon_of_an_exact_homography_is_zero(degrees):
    T = random_pose(rng(1), math.radians(degrees))
    face, H = face_and_exact_homography(T)
    assert tilt.epsilon(detection(H), face, CAMERA, T) < 1e-9


@pytest.mark.parametrize("shear", [0.002, 0.05, -0.3])
def test_epsilon_of_a_skewed_homography_is_the_chord_of_the_skew(shear):
    T = random_pose(rng(2), 0.6)
    face, H = face_and_exact_homography(T)
    # x leans towards y by δ = atan(shear): recalculated at right angles, it moves by 2·sin(δ/2).
    skew = np.array([[1.0, 0.0, 0.0], [shear, 1.0, -shear * 150.0], [0.0, 0.0, 1.0]])
    expected = 2.0 * math.sin(abs(math.atan(shear)) / 2.0)
    assert tilt.epsilon(detection(H @ skew), face, CAMERA, T) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("recalls", "largest"),
    [
        ({0: 1.0, 30: 0.95, 60: 0.949}, 30.0),
        ({60: 1.0, 0: 1.0, 30: 0.5}, 0.0),
        ({0: 0.9, 30: 1.0}, 0.0),
        ({0: 1.0, 30: 1.0}, 30.0),
    ],
)
def test_largest_tilt_wants_the_recall_at_every_smaller_tilt_too(recalls, largest):
    assert tilt._largest_tilt(recalls) == largest


def test_recall_counts_corner_errors_below_five_pixels():
    trials = [tilt.Trial(error, error, 0.0, 0.0) for error in (0.1, 4.999, 5.0, math.inf)]
    assert tilt._recall(trials) == 0.5


def test_corner_medians_are_over_the_faces_found():
    errors = [(0.2, 0.4), (0.1, 0.9), (0.3, 0.5), (5.0, 0.1), (math.inf, math.inf)]
    trials = [tilt.Trial(*pair, 0.0, 0.0) for pair in errors]
    assert tilt._corner_medians(trials) == (0.2, 0.5)
    assert all(math.isnan(median) for median in tilt._corner_medians(trials[3:]))


def test_the_corner_error_by_matches_is_that_of_the_homography_before_the_alignment():
    T = random_pose(rng(3), 0.6)
    face, aligned = face_and_exact_homography(T)
    matched = np.array([[1.0, 0.0, 0.6], [0.0, 1.0, -0.8], [0.0, 0.0, 1.0]]) @ aligned
    nothing = np.zeros((0, 2))
    shown = FaceDetection("front", aligned, matched, np.zeros((4, 2)), nothing, nothing, 1.0, 1.0)
    true = apply_homography(aligned, reference_corners(300, 200))
    found = tilt._matched_corners(Detection("thing", 0, (shown,), 1.0, None), face, CAMERA)
    assert corner_error(found, true) == pytest.approx(1.0)


def test_medians_are_over_frames_with_a_pose_and_recall_over_all():
    trials = [PoseTrial(1.0, 10.0), PoseTrial(3.0, 30.0), PoseTrial(2.0, 40.0), PoseTrial()]
    assert _medians(trials) == (2.0, 30.0, 0.75)
    rotation, translation, recall = _medians([PoseTrial()])
    assert math.isnan(rotation)
    assert math.isnan(translation)
    assert recall == 0.0


@pytest.mark.parametrize("degrees", [0, 30, 70])
@pytest.mark.parametrize("position", [(0.0, 0.0, 0.7), (0.15, -0.1, 0.9)])
def test_tilt_is_the_angle_between_the_normal_and_the_line_of_sight(degrees, position):
    for axis, roll in ((0.0, 0.0), (1.0, 2.0), (4.0, 5.5)):
        pose = facing_pose(np.array(position), math.radians(degrees), axis, roll)
        sight = np.array(position) / np.linalg.norm(position)
        cosine = -pose.rotation.as_matrix()[:, 2] @ sight
        assert math.degrees(math.acos(min(cosine, 1.0))) == pytest.approx(degrees, abs=1e-5)


def test_a_pose_without_tilt_and_roll_shows_the_face_upright():
    pose = facing_pose(np.array([0.0, 0.0, 1.0]), 0.0, 0.0, 0.0)
    np.testing.assert_allclose(pose.rotation.as_matrix(), np.diag([1.0, -1.0, -1.0]), atol=1e-12)


def hidden_share(share, seed, degrees):
    texture = np.full((50, 60, 3), 200, np.uint8)
    pose = random_pose(rng([1, seed]), math.radians(degrees), offset=(0.02, 0.02))
    face = Rectangle(texture, 0.24, 0.2, pose)
    rendering = render([face, occluder(face, share, rng(seed))], CAMERA, rng())
    return 1.0 - rendering.visible[0]


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("share", [0.2, 0.4])
def test_an_occluder_hides_the_stated_share(share, seed):
    assert hidden_share(share, seed, 0) == pytest.approx(share, abs=0.01)
    # The nearer part of a tilted face fills more of the image than its share of the area.
    assert hidden_share(share, seed, 40) == pytest.approx(share, abs=0.08)


def test_occluders_come_from_all_sides_and_are_nearer_than_the_face():
    face = rectangles_of(photograph("coffee"), facing_pose(np.array([0, 0, 0.7]), 0, 0, 0))[0]
    centers = []
    for seed in range(20):
        hider = occluder(face, 0.3, rng(seed))
        assert 0.4 <= hider.T_camera_rectangle.translation[2] <= 0.7 - 0.029
        centers.append(hider.T_camera_rectangle.translation[:2])
    x, y = np.transpose(centers)
    assert x.min() < -0.02
    assert x.max() > 0.02
    assert y.min() < -0.02
    assert y.max() > 0.02


@pytest.mark.parametrize(
    ("photo", "degrees", "group"),
    [
        ("coffee", 60, "well-textured ≤ 60°"),
        ("coffee", 65, ""),
        ("chelsea", 70, "well-textured ≥ 70°"),
        ("retina", 0, "weak ≤ 60°"),
        ("rocket", 75, "weak ≥ 70°"),
    ],
)
def test_estimators_are_compared_in_four_groups(photo, degrees, group):
    assert group_of(photo, degrees) == group


def test_the_photographs_are_there():
    assert textures.WELL_TEXTURED == ("astronaut", "coffee", "chelsea", "immunohistochemistry")
    assert textures.WEAK == ("rocket", "retina")
    for name in textures.OBJECTS:
        image = textures.texture(name)
        assert image.dtype == np.uint8
        assert image.ndim == 3
        assert image.shape[2] == 3
        assert min(image.shape[:2]) >= 300
        assert image.std() > 20


def test_backgrounds_are_other_pictures_than_the_objects():
    objects = {textures.texture(name).tobytes() for name in textures.OBJECTS}
    assert len(textures.backgrounds()) >= 8
    assert not objects & {image.tobytes() for image in textures.backgrounds()}
    garage = textures.background("motorcycle_left")
    assert any(np.array_equal(garage, image) for image in textures.backgrounds())


def test_a_random_background_depends_on_the_seed_only():
    first, again, other = (textures.random_background(rng(s)) for s in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert first.shape != other.shape or not np.array_equal(first, other)
