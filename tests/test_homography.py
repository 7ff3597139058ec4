import re

import cv2
import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.homography import (
    HomographyConfig,
    apply_homography,
    check_outline,
    check_shape,
    coverage,
    hypotheses,
    reference_corners,
    refine,
)
from planegrasp.matching.index import Candidates
from planegrasp.objects import PlanarFace

CAMERA = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
SIZE = (400, 300)
FACE = PlanarFace("front", np.zeros((300, 400, 3), np.uint8), 0.2)
CONFIG = HomographyConfig()
FRONTAL = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))


def true_homography(tilt=30.0, roll=15.0, position=(0.02, -0.01, 0.6), face=FACE):
    rotation = Rotation.from_euler("yz", [tilt, roll], degrees=True) * FRONTAL
    T = RigidTransform.from_components(position, rotation)
    R = T.rotation.as_matrix()
    plane = np.column_stack([R[:, 0], R[:, 1], T.translation])
    matrix = CAMERA.matrix @ plane @ face.face_from_edge
    return matrix / matrix[2, 2]


def jacobians(H, points):
    """Local maps of a homography at N×2 points."""
    w = points @ H[2, :2] + H[2, 2]
    mapped = apply_homography(H, points)
    return (H[:2, :2] - mapped[:, :, None] * H[2, :2]) / w[:, None, None]


def evidence(reference, image, ratio=None, affine=None):
    """Candidates of one face, each feature with one neighbour."""
    n = len(reference)
    frames = np.broadcast_to(np.eye(2), (n, 2, 2)) if affine is None else affine
    return Candidates(
        face=np.zeros((n, 1), np.int32),
        points=reference[:, None].astype(np.float32),
        reference_frames=np.broadcast_to(np.eye(2, dtype=np.float32), (n, 1, 2, 2)),
        distances=np.full((n, 1), 0.1, np.float32),
        image_points=image,
        image_frames=frames,
        ratio=np.full(n, 0.5) if ratio is None else ratio,
    )


def scene(rng, good, bad=0, noise=0.0, H=None):
    """True correspondences, then wrong ones; float32 points as the index has them."""
    H = true_homography() if H is None else H
    reference = rng.uniform((0, 0), SIZE, (good + bad, 2)).astype(np.float32).astype(float)
    image = apply_homography(H, reference) + rng.normal(0, noise, reference.shape)
    image[good:] = rng.uniform((0, 0), (640, 480), (bad, 2))
    return reference, image


def first(candidates, config=CONFIG):
    return next(hypotheses(candidates, 0, config), None)


def corner_errors(matrix, H):
    corners = reference_corners(*SIZE)
    return np.linalg.norm(apply_homography(matrix, corners) - apply_homography(H, corners), axis=1)


@pytest.mark.parametrize("tilt", [0.0, 30.0, 65.0])
def test_exact_matches_give_the_exact_homography(tilt):
    H = true_homography(tilt)
    estimate = first(evidence(*scene(np.random.default_rng(0), 40, H=H)))
    assert corner_errors(estimate.matrix, H).max() < 1e-4
    assert len(estimate.inliers) == 40
    assert estimate.matrix[2, 2] == 1.0


@pytest.mark.parametrize("share", [0.5, 0.75])
def test_wrong_matches_do_not_change_the_result(share):
    rng = np.random.default_rng(1)
    good = 40
    bad = round(good * share / (1 - share))
    reference, image = scene(rng, good, bad)
    estimate = first(evidence(reference, image))
    assert corner_errors(estimate.matrix, true_homography()).max() < 1e-3
    # A wrong match lies within 3 px of where it should with a chance of one in ten thousand.
    assert set(range(good)) <= set(estimate.inliers.query)
    assert len(estimate.inliers) <= good + 1


def test_noise_is_averaged_over_the_matches():
    rng = np.random.default_rng(2)
    errors = []
    for _ in range(20):
        estimate = first(evidence(*scene(rng, 100, 50, noise=0.5)))
        errors.append(corner_errors(estimate.matrix, true_homography()))
    # Least squares at a corner, 100 points of σ = 0.5 px: about 0.5·√(2·8/100)·(1 to 2) px.
    assert np.sqrt(np.mean(np.square(errors))) < 0.5
    # Any four of the points give errors of whole pixels.


def test_matches_with_a_better_ratio_are_tried_first():
    # 12 of 300 right: drawn blindly, four right ones come once in 400 000 samples.
    rng = np.random.default_rng(3)
    reference, image = scene(rng, 12, 288)
    ratio = np.r_[np.full(12, 0.2), np.full(288, 0.7)]
    shuffled = rng.permutation(300)
    reference, image, ratio = reference[shuffled], image[shuffled], ratio[shuffled]
    config = HomographyConfig(iterations=300)
    helped = first(evidence(reference, image, ratio), config)
    assert corner_errors(helped.matrix, true_homography()).max() < 0.1
    blind = first(evidence(reference, image), config)
    assert blind is None or corner_errors(blind.matrix, true_homography()).max() > 5


def test_refused_matches_that_agree_take_part_in_the_refinement():
    rng = np.random.default_rng(4)
    reference, image = scene(rng, 60)
    ratio = np.r_[np.full(20, 0.5), np.full(40, 0.99)]
    assert len(first(evidence(reference, image, ratio)).inliers) == 60


def test_few_matches_with_weak_ratios_are_found_by_their_mutual_support():
    rng = np.random.default_rng(5)
    H = true_homography(50.0)
    reference, image = scene(rng, 12, 150, H=H)
    affine = jacobians(H, reference)
    turn = Rotation.from_rotvec(rng.uniform(0, 6.3, (150, 1)) * [0, 0, 1]).as_matrix()[:, :2, :2]
    affine[12:] = turn * rng.uniform(0.3, 2, (150, 1, 1))
    ratio = np.full(162, 0.85)  # none passes the strict test
    found = list(hypotheses(evidence(reference, image, ratio, affine), 0, CONFIG))
    assert len(found) == 1
    assert corner_errors(found[0].matrix, H).max() < 0.1
    strict_only = HomographyConfig(max_loose_ratio=0.8)
    assert not list(hypotheses(evidence(reference, image, ratio, affine), 0, strict_only))


@pytest.mark.parametrize("count", [0, 1, 9])
def test_fewer_matches_than_the_minimum_give_nothing(count):
    assert first(evidence(*scene(np.random.default_rng(0), count))) is None


def test_the_minimum_is_that_of_the_settings():
    candidates = evidence(*scene(np.random.default_rng(0), 6))
    assert first(candidates) is None
    assert first(candidates, HomographyConfig(min_matches=6)) is not None


def plausible(estimate):
    """Whether an estimate passes the checks that follow it."""
    return (
        estimate is not None
        and len(estimate.inliers) >= CONFIG.min_inliers
        and not check_outline(estimate.matrix, SIZE, CAMERA, CONFIG)
        and not check_shape(estimate.matrix, FACE.face_from_edge, CAMERA, CONFIG)[0]
        and coverage(estimate.inliers.reference_points, *SIZE) >= CONFIG.min_coverage
    )


@pytest.mark.parametrize("kind", ["collinear", "one point", "two points", "one image point"])
def test_degenerate_matches_are_never_accepted(kind):
    rng = np.random.default_rng(6)
    reference, image = scene(rng, 30)
    if kind == "collinear":
        reference[:, 1] = 0.5 * reference[:, 0] + 20
    elif kind == "one point":
        reference[:] = reference[0]
    elif kind == "two points":
        reference[:] = reference[rng.integers(0, 2, 30)]
    if kind == "one image point":
        image[:] = image[0]
    else:
        image = apply_homography(true_homography(), reference)
    candidates = evidence(reference, image)
    assert not any(plausible(e) for e in hypotheses(candidates, 0, CONFIG))


def test_a_good_scene_is_plausible():
    assert plausible(first(evidence(*scene(np.random.default_rng(6), 30))))


def test_only_noise_gives_nothing_plausible():
    for seed in range(10):
        candidates = evidence(*scene(np.random.default_rng(seed), 0, 60))
        assert not any(plausible(e) for e in hypotheses(candidates, 0, CONFIG))


def test_a_feature_described_twice_counts_once():
    reference, image = scene(np.random.default_rng(7), 20)
    twice = evidence(np.repeat(reference, 2, axis=0), np.repeat(image, 2, axis=0))
    assert len(first(twice).inliers) == 20


def test_the_same_evidence_gives_the_same_estimate():
    candidates = evidence(*scene(np.random.default_rng(8), 30, 60, noise=0.5))
    a, b = first(candidates), first(candidates)
    np.testing.assert_array_equal(a.matrix, b.matrix)
    np.testing.assert_array_equal(a.inliers.query, b.inliers.query)


def test_refine_improves_a_rough_guess():
    candidates = evidence(*scene(np.random.default_rng(9), 50))
    shifted = true_homography()
    shifted[0, 2] += 1.5
    refined = refine(shifted, candidates, 0, CONFIG)
    assert corner_errors(refined.matrix, true_homography()).max() < 1e-3


@pytest.mark.parametrize("guess", [np.zeros((3, 3)), np.full((3, 3), np.nan), np.eye(3)])
def test_refine_has_no_answer_to_a_guess_that_no_match_agrees_with(guess):
    candidates = evidence(*scene(np.random.default_rng(9), 50))
    assert refine(guess, candidates, 0, CONFIG) is None


def outline(*corners):
    """The homography that puts the reference's corners there."""
    source = reference_corners(*SIZE).astype(np.float32)
    return cv2.getPerspectiveTransform(source, np.array(corners, np.float32))


@pytest.mark.parametrize("tilt", [0.0, 30.0, 70.0])
@pytest.mark.parametrize("roll", [0.0, 90.0, 180.0, -45.0])
def test_true_views_pass_every_check(tilt, roll):
    H = true_homography(tilt, roll)
    assert check_outline(H, SIZE, CAMERA, CONFIG) == ""
    reason, stretch = check_shape(H, FACE.face_from_edge, CAMERA, CONFIG)
    assert reason == ""
    assert stretch == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize(
    ("corners", "reason"),
    [
        ([(300, 100), (100, 100), (100, 250), (300, 250)], "mirrored"),
        # A homography makes such outlines only where its horizon cuts through the face.
        ([(100, 100), (300, 100), (100, 250), (300, 250)], "behind the camera"),
        ([(100, 100), (300, 100), (150, 140), (100, 250)], "behind the camera"),
        ([(100, 100), (104, 100), (104, 103), (100, 103)], r"3\.0 px short \(at least 8 px\)"),
        ([(100, 100), (300, 100), (300, 107), (100, 107)], r"7\.0 px short"),
        ([(-300, 100), (-100, 100), (-100, 250), (-300, 250)], "outside of the image"),
        ([(100, 500), (300, 500), (300, 650), (100, 650)], "outside of the image"),
    ],
)
def test_outlines_that_cannot_be_are_refused_with_the_reason(corners, reason):
    assert re.search(reason, check_outline(outline(*corners), SIZE, CAMERA, CONFIG))


def test_an_outline_without_area_is_refused():
    H = np.array([[1.0, 0, 100], [0.5, 0, 100], [0, 0, 1]])  # every point onto one line
    assert "not a convex" in check_outline(H, SIZE, CAMERA, CONFIG)


def test_a_face_partly_behind_the_camera_is_refused():
    H = true_homography()
    H[2, 0] = -1.5 / SIZE[0]  # w is 1 at the left edge and -0.5 at the right one
    assert "behind the camera" in check_outline(H, SIZE, CAMERA, CONFIG)


def test_an_outline_that_leaves_the_image_partly_is_accepted():
    half_outside = outline((-100, 100), (100, 100), (100, 250), (-100, 250))
    assert check_outline(half_outside, SIZE, CAMERA, CONFIG) == ""


def test_the_smallest_side_is_that_of_the_settings():
    small = outline((100, 100), (300, 100), (300, 107), (100, 107))
    assert check_outline(small, SIZE, CAMERA, HomographyConfig(min_side=5.0)) == ""


@pytest.mark.parametrize("factor", [1.7, 2.5])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_wrong_aspect_ratio_is_refused_with_the_factor(factor, axis):
    stretch = np.eye(3)
    stretch[axis, axis] = factor
    # Stretched about the face's centre, seen straight on.
    to_centre = np.array([[1, 0, -200.0], [0, 1, -150.0], [0, 0, 1]])
    H = true_homography(0.0) @ np.linalg.inv(to_centre) @ stretch @ to_centre
    reason, found = check_shape(H, FACE.face_from_edge, CAMERA, CONFIG)
    assert found == pytest.approx(factor)
    assert f"stretched by {factor:.2f} (at most 1.6)" in reason
    assert check_shape(H, FACE.face_from_edge, CAMERA, HomographyConfig(max_stretch=3.0))[0] == ""


def test_skew_is_refused_too():
    skew = np.array([[1, 0.8, -120.0], [0, 1, 0], [0, 0, 1]])
    reason, _ = check_shape(true_homography(0.0) @ skew, FACE.face_from_edge, CAMERA, CONFIG)
    assert "stretched" in reason


def test_coverage_is_the_share_of_the_hull():
    square = np.array([[100.0, 100], [200, 100], [200, 200], [100, 200], [150, 150]])
    assert coverage(square, *SIZE) == pytest.approx(100 * 100 / (400 * 300))
    assert coverage(square[:2], *SIZE) == 0.0
    assert coverage(np.column_stack([np.arange(9.0), np.arange(9.0)]), *SIZE) == 0.0
    assert coverage(reference_corners(*SIZE), *SIZE) == 1.0


def test_points_at_infinity_become_infinite_without_a_warning():
    H = np.array([[1.0, 0, 1], [0, 1, 1], [1, 0, 0]])
    assert np.all(np.isinf(apply_homography(H, np.array([[0.0, 0.0]]))))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"min_matches": 3}, "at least 4 matches and inliers, got min_matches=3"),
        ({"min_inliers": 0}, "min_inliers=0"),
        ({"max_ratio": 0.0}, "0 < max_ratio ≤ max_loose_ratio ≤ 1, got 0.0"),
        ({"max_ratio": 0.95}, "max_loose_ratio"),
        ({"max_loose_ratio": 1.1}, "max_loose_ratio"),
        ({"threshold": 0.0}, "threshold > 0"),
        ({"max_stretch": 1.0}, "max_stretch > 1"),
    ],
)
def test_impossible_settings_are_refused(wrong, message):
    with pytest.raises(InvalidInputError, match=message):
        HomographyConfig(**wrong)
