"""From matches with exact truth to homographies and verified faces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.features import Features
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.homography import HomographyConfig, apply_homography, reference_corners
from planegrasp.matching.index import Candidates, ReferenceSet
from planegrasp.objects import ObjectModel
from planegrasp.references import FaceReference
from planegrasp.search import FaceSearch, View

CAMERA = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
SIZE = (400, 300)
CONFIG = HomographyConfig()
FRONTAL = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
NOTHING = np.zeros((480, 640), np.uint8)
TEXTURE = cv2.resize(
    np.random.default_rng(0).integers(0, 256, (24, 32)).astype(np.uint8), SIZE
).astype(np.uint8)
MODEL = ObjectModel.from_image("card", np.dstack([TEXTURE] * 3), 0.2)


def true_homography(tilt=30.0, roll=15.0, position=(0.02, -0.01, 0.6)):
    rotation = Rotation.from_euler("yz", [tilt, roll], degrees=True) * FRONTAL
    T = RigidTransform.from_components(position, rotation)
    R = T.rotation.as_matrix()
    plane = np.column_stack([R[:, 0], R[:, 1], T.translation])
    matrix = CAMERA.matrix @ plane @ MODEL.faces[0].face_from_edge
    return matrix / matrix[2, 2]


def jacobians(H, points):
    """Local maps of a homography at N×2 points."""
    w = points @ H[2, :2] + H[2, 2]
    mapped = apply_homography(H, points)
    return (H[:2, :2] - mapped[:, :, None] * H[2, :2]) / w[:, None, None]


@dataclass(frozen=True)
class Pairs:
    """Feature i of the frame looks like keypoint i of the face, and like no other."""

    reference: np.ndarray
    image: np.ndarray
    ratio: np.ndarray
    affine: np.ndarray

    def __len__(self):
        return len(self.reference)

    def candidates(self):
        number = np.arange(len(self), dtype=np.int32)[:, None]
        distances = np.full(number.shape, 0.1, np.float32)
        return Candidates(0 * number, number, distances, self.ratio.astype(np.float32))

    def features(self):
        one, empty = np.ones(len(self), np.float32), np.zeros((len(self), 0), np.float32)
        return Features(self.image.astype(np.float32), one, 0 * one, one, empty)

    def face(self):
        # Features have the frames of pixels: the keypoints' say the rest of the local map.
        frames = np.linalg.inv(self.affine).astype(np.float32)
        descriptors = np.zeros((len(self), 0), np.float32)
        kept = ReferenceSet(self.reference.astype(np.float32), frames, descriptors, 5.0)
        return FaceReference(MODEL, MODEL.faces[0]), kept

    def search(self, config=CONFIG):
        """A search for this one face, and the evidence of these matches."""
        search = searching([self.face()], config)
        return search, search.evidence(self.candidates(), self.features(), self.image)


def searching(faces, config=CONFIG):
    """A search for these faces."""
    search = FaceSearch(config)
    for reference, features in faces:
        search.add(reference, features)
    return search


def pairs(reference, image, ratio=None, affine=None):
    n = len(reference)
    ratio = np.full(n, 0.5) if ratio is None else ratio
    affine = np.tile(np.eye(2), (n, 1, 1)) if affine is None else affine
    return Pairs(reference, image, ratio, affine)


def scene(rng, good, bad=0, noise=0.0, H=None):
    """True correspondences, then wrong ones; float32 points as the index has them."""
    H = true_homography() if H is None else H
    reference = rng.uniform((0, 0), SIZE, (good + bad, 2)).astype(np.float32).astype(float)
    image = apply_homography(H, reference) + rng.normal(0, noise, reference.shape)
    image[good:] = rng.uniform((0, 0), (640, 480), (bad, 2))
    return reference, image


def hypotheses(matches, config=CONFIG):
    search, evidence = matches.search(config)
    return search.hypotheses(evidence, 0, CAMERA)


def first(matches, config=CONFIG):
    return next(iter(hypotheses(matches, config)), None)


def refine(start, matches):
    search, evidence = matches.search()
    return search.refine(start, evidence, 0, CAMERA)


def view_of(matches, evidence, gray=NOTHING, camera=CAMERA):
    return View(matches.features(), matches.image, evidence, gray, camera)


def find_all(search, view, max_instances=8, *, explain=True, among=(0,)):
    """Every instance of these faces by face, and the reports of all attempts."""
    outcomes = search.find(view, np.array(among, np.uint32), max_instances, explain=explain)
    found = {face: outcome.found for face, outcome in outcomes.items() if outcome.found}
    return found, [report for outcome in outcomes.values() for report in outcome.reports]


def plausible(matches):
    """Whether a face is found, whatever it looks like."""
    blind = replace(CONFIG, min_agreement=0.0, min_doubtful_tiles=0.0)
    search, evidence = matches.search(blind)
    return bool(find_all(search, view_of(matches, evidence))[0])


def corner_errors(matrix, H):
    corners = reference_corners(*SIZE)
    return np.linalg.norm(apply_homography(matrix, corners) - apply_homography(H, corners), axis=1)


@pytest.mark.parametrize("tilt", [0.0, 30.0, 65.0])
def test_exact_matches_give_the_exact_homography(tilt):
    H = true_homography(tilt)
    estimate = first(pairs(*scene(np.random.default_rng(0), 40, H=H)))
    assert corner_errors(estimate.matrix, H).max() < 1e-4
    assert len(estimate.inliers) == 40
    assert estimate.matrix[2, 2] == 1.0


@pytest.mark.parametrize("share", [0.5, 0.75])
def test_wrong_matches_do_not_change_the_result(share):
    rng = np.random.default_rng(1)
    good = 40
    bad = round(good * share / (1 - share))
    estimate = first(pairs(*scene(rng, good, bad)))
    assert corner_errors(estimate.matrix, true_homography()).max() < 1e-3
    # A wrong match lies within 3 px of where it should with a chance of one in ten thousand.
    assert set(range(good)) <= set(estimate.inliers.query)
    assert len(estimate.inliers) <= good + 1


def test_noise_is_averaged_over_the_matches():
    rng = np.random.default_rng(2)
    errors = []
    for _ in range(20):
        estimate = first(pairs(*scene(rng, 100, 50, noise=0.5)))
        errors.append(corner_errors(estimate.matrix, true_homography()))
    # Least squares at a corner, 100 points of σ = 0.5 px: about 0.5·√(2·8/100)·(1 to 2) px.
    assert np.sqrt(np.mean(np.square(errors))) < 0.5
    # Any four of the points give errors of whole pixels.


def test_inliers_are_the_matches_that_were_given():
    reference, image = scene(np.random.default_rng(10), 20, 10)
    ratio = np.linspace(0.3, 0.7, 30)
    inliers = first(pairs(reference, image, ratio)).inliers
    kept = inliers.query
    np.testing.assert_array_equal(inliers.reference_points, reference[kept])
    np.testing.assert_array_equal(inliers.image_points, image[kept])
    np.testing.assert_array_equal(inliers.ratio, ratio.astype(np.float32)[kept])
    assert np.all(np.diff(kept.astype(int)) > 0)


def test_matches_with_a_better_ratio_are_tried_first():
    # 12 of 300 right: drawn blindly, four right ones come once in 400 000 samples.
    rng = np.random.default_rng(3)
    reference, image = scene(rng, 12, 288)
    ratio = np.r_[np.full(12, 0.2), np.full(288, 0.7)]
    shuffled = rng.permutation(300)
    reference, image, ratio = reference[shuffled], image[shuffled], ratio[shuffled]
    config = HomographyConfig(iterations=300)
    helped = first(pairs(reference, image, ratio), config)
    assert corner_errors(helped.matrix, true_homography()).max() < 0.1
    blind = first(pairs(reference, image), config)
    assert blind is None or corner_errors(blind.matrix, true_homography()).max() > 5


def test_refused_matches_that_agree_take_part_in_the_refinement():
    reference, image = scene(np.random.default_rng(4), 60)
    ratio = np.r_[np.full(20, 0.5), np.full(40, 0.99)]
    assert len(first(pairs(reference, image, ratio)).inliers) == 60


def test_few_matches_with_weak_ratios_are_found_by_their_mutual_support():
    rng = np.random.default_rng(5)
    H = true_homography(50.0)
    reference, image = scene(rng, 12, 150, H=H)
    affine = jacobians(H, reference)
    turn = Rotation.from_rotvec(rng.uniform(0, 6.3, (150, 1)) * [0, 0, 1]).as_matrix()[:, :2, :2]
    affine[12:] = turn * rng.uniform(0.3, 2, (150, 1, 1))
    matches = pairs(reference, image, np.full(162, 0.85), affine)  # none passes the strict test
    found = hypotheses(matches)
    assert len(found) == 1
    assert corner_errors(found[0].matrix, H).max() < 0.1
    assert not hypotheses(matches, HomographyConfig(max_loose_ratio=0.8))


@pytest.mark.parametrize("count", [0, 1, 9])
def test_fewer_matches_than_the_minimum_give_nothing(count):
    assert first(pairs(*scene(np.random.default_rng(0), count))) is None


def test_the_minimum_is_that_of_the_settings():
    matches = pairs(*scene(np.random.default_rng(0), 6))
    assert first(matches) is None
    assert first(matches, HomographyConfig(min_matches=6)) is not None


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
    assert not plausible(pairs(reference, image))


def test_a_good_scene_is_plausible():
    assert plausible(pairs(*scene(np.random.default_rng(6), 30)))


def test_only_noise_gives_nothing_plausible():
    for seed in range(10):
        assert not plausible(pairs(*scene(np.random.default_rng(seed), 0, 60)))


def test_a_feature_described_twice_counts_once():
    reference, image = scene(np.random.default_rng(7), 20)
    twice = pairs(np.repeat(reference, 2, axis=0), np.repeat(image, 2, axis=0))
    assert len(first(twice).inliers) == 20


def test_the_same_evidence_gives_the_same_estimate():
    matches = pairs(*scene(np.random.default_rng(8), 30, 60, noise=0.5))
    a, b = first(matches), first(matches)
    np.testing.assert_array_equal(a.matrix, b.matrix)
    np.testing.assert_array_equal(a.inliers.query, b.inliers.query)


def test_refine_improves_a_rough_guess():
    shifted = true_homography()
    shifted[0, 2] += 1.5
    refined = refine(shifted, pairs(*scene(np.random.default_rng(9), 50)))
    assert corner_errors(refined.matrix, true_homography()).max() < 1e-3


@pytest.mark.parametrize("guess", [np.zeros((3, 3)), np.full((3, 3), np.nan), np.eye(3)])
def test_refine_has_no_answer_to_a_guess_that_no_match_agrees_with(guess):
    assert refine(guess, pairs(*scene(np.random.default_rng(9), 50))) is None


def seen_at(*homographies):
    """A frame that shows the face at these places."""
    frame = np.full((480, 640), 128, np.uint8)
    half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1.0]])
    for H in homographies:
        cv2.warpPerspective(
            TEXTURE, H @ half, (640, 480), dst=frame, borderMode=cv2.BORDER_TRANSPARENT
        )
    return frame


LEFT = true_homography(30.0, 0.0, (-0.15, 0.0, 0.7))
RIGHT = true_homography(0.0, 40.0, (0.15, 0.02, 0.7))


def two_instances(left=40, right=60):
    rng = np.random.default_rng(11)
    at_left, at_right = scene(rng, left, H=LEFT), scene(rng, right, H=RIGHT)
    mixed = rng.permutation(left + right)
    return pairs(*(np.concatenate(both)[mixed] for both in zip(at_left, at_right, strict=True)))


def find(matches, gray, max_instances=8, *, explain=True):
    search, evidence = matches.search()
    view = view_of(matches, evidence, gray)
    return find_all(search, view, max_instances, explain=explain)


def test_every_instance_is_found_the_best_supported_first():
    found, reports = find(two_instances(), seen_at(LEFT, RIGHT))
    assert list(found) == [0]
    for detection, H, inliers in zip(found[0], (RIGHT, LEFT), (60, 40), strict=True):
        assert corner_errors(detection.matched_homography, H).max() < 1e-3
        # Grey values tell hundredths of a pixel, exact matches are better still.
        assert corner_errors(detection.homography, H).max() < 0.05
        corners = apply_homography(detection.homography, reference_corners(*SIZE))
        np.testing.assert_allclose(detection.corners, corners, atol=1e-9)
        assert detection.inliers == inliers
        assert detection.agreement > 0.9
    # The attempt after the last instance is no news.
    attempts = [(r.instance, r.found, r.stage) for r in reports]
    assert attempts == [(0, True, "found"), (1, True, "found")]
    assert [r.figures["matches"] for r in reports] == [100, 40]


def test_no_more_instances_are_looked_for_than_asked():
    found, reports = find(two_instances(), seen_at(LEFT, RIGHT), max_instances=1)
    assert len(found[0]) == len(reports) == 1


def test_an_instance_that_does_not_look_like_the_face_is_no_instance():
    found, reports = find(two_instances(), seen_at(RIGHT))
    assert [d.inliers for d in found[0]] == [60]
    assert len(reports) == 1
    found, (report,) = find(two_instances(), NOTHING)
    assert not found
    assert (report.stage, report.found) == ("verification", False)
    assert report.reason == "0% of the face looks like its reference (at least 30%)"
    figures = {"features": 100, "matches": 100, "agreement": 0}
    assert figures.items() <= report.figures.items()
    assert report.figures["inliers"] in (40, 60)  # those of the last homography that was refused
    assert report.figures["stretch"] == pytest.approx(1, abs=1e-4)
    assert 0.5 < report.figures["coverage"] < 1


def test_many_matches_on_one_spot_are_no_face_unless_it_looks_like_it():
    """They may be one thing that looks alike by chance; as many all over the face are none."""
    H, rng = true_homography(), np.random.default_rng(5)

    def matches_within(share):
        # Sides of the spot that they lie on; coordinates as the index has them.
        sides = np.sqrt(share) * np.array(SIZE)
        reference = (40 + rng.uniform((0, 0), sides, (75, 2))).astype(np.float32).astype(float)
        return pairs(reference, apply_homography(H, reference))

    spot = matches_within(0.1)
    search, evidence = spot.search(replace(CONFIG, min_agreement=0.0))
    found, (report,) = find_all(search, view_of(spot, evidence))
    assert not found
    assert report.reason.startswith("inliers are few or close together, and 0% of the aligned")
    assert report.figures["inliers"] == 75
    search, evidence = spot.search()
    assert find_all(search, view_of(spot, evidence, seen_at(H)))[0]
    spread = matches_within(0.5)
    search, evidence = spread.search(replace(CONFIG, min_agreement=0.0))
    assert find_all(search, view_of(spread, evidence))[0]


def test_only_what_was_found_is_reported_where_no_explanation_is_asked_for():
    some, none = two_instances(), pairs(*scene(np.random.default_rng(0), 4))
    search = searching([some.face(), none.face()])
    evidence = search.evidence(some.candidates(), some.features(), some.image)
    view = view_of(some, evidence, seen_at(LEFT, RIGHT))
    for explain, expected in ((True, [True, True, False]), (False, [True, True])):
        found, reports = find_all(search, view, explain=explain, among=(0, 1))
        assert [r.found for r in reports] == expected
        assert [len(found[number]) for number in found] == [2]
    assert find_all(search, view, among=(0, 1))[1][2].reason == "0 matches (at least 10)"


def test_a_reference_without_features_is_reported_as_such():
    some, empty = two_instances(), pairs(np.zeros((0, 2)), np.zeros((0, 2)))
    search = searching([empty.face(), some.face()])
    evidence = search.evidence(some.candidates(), some.features(), some.image)
    _, (report, other) = find_all(search, view_of(some, evidence), among=(0, 1))
    assert report.stage == "features"
    assert report.reason == "the reference image has no features"
    assert report.figures == {"features": 100}
    assert other.stage == "matching"


def test_corners_are_where_the_lens_shows_them():
    lens = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5, (0.1, -0.2))
    some = two_instances()
    search, evidence = some.search()
    found, _ = find_all(search, view_of(some, evidence, seen_at(LEFT, RIGHT), lens), 1)
    expected = lens.distort(apply_homography(RIGHT, reference_corners(*SIZE)))
    np.testing.assert_allclose(found[0][0].corners, expected, atol=1e-3)


def test_a_predicted_face_is_verified_whatever_the_ratio_of_its_matches():
    some = replace(two_instances(), ratio=np.full(100, 0.99))
    search, evidence = some.search()
    view = view_of(some, evidence, seen_at(LEFT, RIGHT))
    assert not find_all(search, view)[0]
    near = LEFT.copy()
    near[1, 2] -= 1.5
    detection = search.look_where(0, near, view)
    assert corner_errors(detection.matched_homography, LEFT).max() < 1e-3
    assert detection.inliers == 40
    # Where the frame shows something else, where no match lies, and where no face can be.
    assert search.look_where(0, near, view_of(some, evidence)) is None
    for elsewhere in (true_homography(), -np.eye(3), np.zeros((3, 3)), np.full((3, 3), np.nan)):
        assert search.look_where(0, elsewhere, view) is None


def test_matches_pass_the_ratio_test_that_is_asked_for():
    some = replace(two_instances(), ratio=np.linspace(0.5, 1.0, 100))
    search, evidence = some.search()
    assert len(evidence) == 100
    assert [len(search.matches(evidence, 0, r)) for r in (0.4, 0.75, 1.0)] == [0, 50, 100]


@pytest.mark.parametrize("number", [1, 10**6, -1])
def test_faces_that_are_not_there_are_refused(number):
    some = two_instances()
    search, evidence = some.search()
    view = view_of(some, evidence)
    for ask in (
        lambda: search.look_where(number, LEFT, view),
        lambda: search.matches(evidence, number, 0.8),
        lambda: search.hypotheses(evidence, number, CAMERA),
        lambda: search.refine(LEFT, evidence, number, CAMERA),
    ):
        with pytest.raises(InvalidInputError, match=f"there are 1 faces, got the number {number}"):
            ask()


def test_only_the_faces_asked_for_are_looked_for():
    some = two_instances()
    search = searching([some.face()] * 3)
    evidence = search.evidence(some.candidates(), some.features(), some.image)
    view = view_of(some, evidence, seen_at(LEFT, RIGHT))
    for faces, found in (([], 0), ([1, 2], 0), ([2, 0], 2)):
        detections, reports = find_all(search, view, among=faces)
        assert len(detections.get(0, [])) == found
        assert len(reports) == len(faces) + (found > 1)
    # Numbers that no face has are left out.
    assert find_all(search, view, among=(3, 2**32 - 1)) == ({}, [])


def test_evidence_for_other_faces_is_refused():
    some = two_instances()
    search, evidence = searching([some.face(), some.face()]), some.search()[1]
    view = view_of(some, evidence)
    for ask in (
        lambda: find_all(search, view),
        lambda: search.look_where(0, LEFT, view),
        lambda: search.matches(evidence, 0, 0.8),
        lambda: search.hypotheses(evidence, 0, CAMERA),
        lambda: search.refine(LEFT, evidence, 0, CAMERA),
    ):
        with pytest.raises(InvalidInputError, match="sorted for 1 faces, there are 2"):
            ask()


def test_keypoints_that_the_face_has_not_match_nothing():
    some = two_instances()
    search, _ = some.search()
    candidates = some.candidates()
    for wrong in (100, -1, np.iinfo(np.int32).max):
        beyond = replace(candidates, reference=np.full((100, 1), wrong, np.int32))
        evidence = search.evidence(beyond, some.features(), some.image)
        assert len(search.matches(evidence, 0, 1.0)) == 0
        assert not find_all(search, view_of(some, evidence))[0]
    for face in (1, -2, np.iinfo(np.int32).max):
        unknown = replace(candidates, face=np.full((100, 1), face, np.int32))
        evidence = search.evidence(unknown, some.features(), some.image)
        assert len(search.matches(evidence, 0, 1.0)) == 0


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"face": np.zeros(100, np.int32)}, r"face must be N×k, got \[100\]"),
        ({"face": np.zeros((100, 2), np.int32)}, r"one shape, got \[100, 2\] and \[100, 1\]"),
        ({"reference": np.zeros((1, 100), np.int32)}, r"got \[100, 1\] and \[1, 100\]"),
        ({"ratio": np.zeros(99, np.float32)}, "100 features need 1 candidates"),
        ({"face": np.zeros((100, 0), np.int32), "reference": np.zeros((100, 0), np.int32)}, "100"),
    ],
)
def test_candidates_of_other_shapes_are_refused(wrong, message):
    some = two_instances()
    search, _ = some.search()
    with pytest.raises(InvalidInputError, match=message):
        search.evidence(replace(some.candidates(), **wrong), some.features(), some.image)


def test_features_that_do_not_fit_are_refused():
    some = two_instances()
    search, _ = some.search()
    candidates, features = some.candidates(), some.features()
    with pytest.raises(InvalidInputError, match="99 features need 1 candidates"):
        search.evidence(candidates, features, some.image[:99])
    with pytest.raises(InvalidInputError, match="image_points must be N×2"):
        search.evidence(candidates, features, np.zeros((100, 3)))
    for name in ("scales", "angles"):
        lost = np.r_[np.full(1, np.nan), np.ones(99)].astype(np.float32)
        with pytest.raises(InvalidInputError, match="features must be finite"):
            search.evidence(candidates, replace(features, **{name: lost}), some.image)
    for value in (np.nan, np.inf):
        image = some.image.copy()
        image[3, 1] = value
        with pytest.raises(InvalidInputError, match="features must be finite"):
            search.evidence(candidates, features, image)


def test_ratios_that_are_no_number_pass_no_test():
    some = replace(two_instances(), ratio=np.full(100, np.nan))
    search, evidence = some.search()
    assert len(search.matches(evidence, 0, 1.0)) == 0
    assert not find_all(search, view_of(some, evidence))[0]


def test_references_with_keypoints_that_are_not_finite_are_refused():
    reference, image = scene(np.random.default_rng(0), 5)
    reference[2, 0] = np.nan
    with pytest.raises(InvalidInputError, match="points and frames must be finite"):
        pairs(reference, image).search()


@pytest.mark.parametrize("shape", [(480, 639), (640, 480), (0, 0), (480, 640, 1)])
def test_an_image_of_another_size_than_the_camera_s_is_refused(shape):
    some = two_instances()
    search, evidence = some.search()
    view = view_of(some, evidence, np.zeros(shape, np.uint8))
    message = "gray must be H×W" if len(shape) == 3 else "an image of 640×480 has 307200 pixels"
    with pytest.raises(InvalidInputError, match=message):
        find_all(search, view)
    with pytest.raises(InvalidInputError, match=message):
        search.look_where(0, LEFT, view)


@pytest.mark.parametrize("shape", [(2, 3), (9,), (4, 4)])
def test_homographies_of_other_shapes_are_refused(shape):
    some = two_instances()
    search, evidence = some.search()
    with pytest.raises(InvalidInputError, match="start must be 3×3"):
        search.refine(np.zeros(shape), evidence, 0, CAMERA)
    with pytest.raises(InvalidInputError, match="predicted must be 3×3"):
        search.look_where(0, np.zeros(shape), view_of(some, evidence))


def test_a_frame_without_features_has_no_faces():
    some, empty = two_instances(), pairs(np.zeros((0, 2)), np.zeros((0, 2)))
    search = searching([some.face()])
    evidence = search.evidence(empty.candidates(), empty.features(), empty.image)
    found, (report,) = find_all(search, view_of(empty, evidence))
    assert not found
    assert (report.stage, report.figures) == ("matching", {"features": 0, "matches": 0})
    assert search.hypotheses(evidence, 0, CAMERA) == []
