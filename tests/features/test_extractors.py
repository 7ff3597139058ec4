from dataclasses import replace

import cv2
import numpy as np
import pytest

from planegrasp.bench.scenes import CAMERA, rectangles
from planegrasp.bench.textures import backgrounds
from planegrasp.errors import ImageError, InvalidInputError
from planegrasp.features import (
    AKAZE,
    BRISK,
    EXTRACTORS,
    ORB,
    SIFT,
    SURF,
    AKAZEConfig,
    BRISKConfig,
    Features,
    OpenCVSIFT,
    OpenCVSIFTConfig,
    ORBConfig,
    SIFTConfig,
    SURFConfig,
    make_extractor,
)
from planegrasp.geometry import RigidTransform, Rotation, edge_from_pixel
from planegrasp.objects import ObjectModel
from planegrasp.simulation import render

NAMES = sorted(EXTRACTORS)
LENGTHS = {"sift": 128, "surf": 64, "opencv-sift": 128, "akaze": 61, "brisk": 64, "orb": 32}
FRONTAL = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))


def gray(image):
    return cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)


def view(photo, name, *, roll, tilt=0.0, distance=0.7):
    """A reference of 256 px, a noisy rendered view of it, and the true homography between them."""
    image = photo(name, width=256)
    model = ObjectModel.from_image(name, image, 0.25)
    rotation = Rotation.from_euler("yz", [tilt, roll], degrees=True) * FRONTAL
    T = RigidTransform.from_components([0.01, 0.02, distance], rotation)
    rng = np.random.default_rng(roll)
    rendering = render(rectangles(model, T), CAMERA, rng, background=backgrounds()[4])
    height, width = image.shape[:2]
    edge = np.array([[0, 0], [width, 0], [width, height], [0, height]], np.float32)
    H = cv2.getPerspectiveTransform(edge, rendering.corners[0].astype(np.float32))
    return gray(image), gray(rendering.frame.color), H


def mutual_matches(a, b, is_binary):
    norm = cv2.NORM_HAMMING if is_binary else cv2.NORM_L2
    matches = cv2.BFMatcher(norm, crossCheck=True).match(a.descriptors, b.descriptors)
    return np.array([(m.queryIdx, m.trainIdx) for m in matches]).T


def displacements(name, reference, seen, H):
    """Where mutual nearest neighbours were found, less where they truly are [px]."""
    extractor = make_extractor(name)
    a, b = extractor.extract(reference), extractor.extract(seen)
    i, j = mutual_matches(a, b, extractor.is_binary)
    true = cv2.perspectiveTransform(edge_from_pixel(a.points[i])[None], H)[0]
    return b.points[j] - true


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("tilt", [0, 35])
def test_points_are_found_again_where_they_truly_are(photo, name, tilt):
    shift = displacements(name, *view(photo, "astronaut", roll=20, tilt=tilt))
    right = np.linalg.norm(shift, axis=1) < 3
    assert np.count_nonzero(right) >= 60
    # By chance, within 3 px on the 35 000 px of the face, one in a thousand would be right.
    assert right.mean() >= 0.25


@pytest.mark.parametrize("name", NAMES)
def test_positions_have_no_bias(photo, name):
    # Seen upside down an offset of the extractor shows doubled instead of cancelling out; seen
    # from farther it would show by how much it grows with the scale.
    shifts = []
    for texture in ("astronaut", "coffee", "immunohistochemistry"):
        shift = displacements(name, *view(photo, texture, roll=180, distance=0.55))
        shifts.append(shift[np.linalg.norm(shift, axis=1) < 3])
    shift = np.concatenate(shifts)
    standard_error = shift.std(axis=0) / np.sqrt(len(shift))
    assert standard_error.max() < 0.03  # enough matches to tell
    assert np.abs(shift.mean(axis=0)).max() < 0.06


@pytest.mark.parametrize("name", NAMES)
def test_keypoints_turn_and_grow_with_the_image(photo, name):
    reference, seen, H = view(photo, "astronaut", roll=70, distance=0.55)
    extractor = make_extractor(name)
    a, b = extractor.extract(reference), extractor.extract(seen)
    i, j = mutual_matches(a, b, extractor.is_binary)
    true = cv2.perspectiveTransform(edge_from_pixel(a.points[i])[None], H)[0]
    right = np.linalg.norm(b.points[j] - true, axis=1) < 2
    local = b.frames[j[right]] @ np.linalg.inv(a.frames[i[right]])
    # Seen straight on the true map is a similarity: the same everywhere.
    expected = H[:2, :2] / H[2, 2]
    turn = np.degrees(np.arctan2(local[:, 1, 0], local[:, 0, 0]))
    error = (turn - np.degrees(np.arctan2(expected[1, 0], expected[0, 0])) + 180) % 360 - 180
    growth = np.sqrt(np.linalg.det(local) / np.linalg.det(expected))
    assert abs(np.median(error)) < 5
    assert np.mean(np.abs(error) < 20) > 0.8
    assert np.median(growth) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize("name", NAMES)
def test_types_and_shapes_are_as_stated(photo, name):
    extractor = make_extractor(name)
    image = gray(photo("coffee", width=300))
    features = extractor.extract(image)
    n = len(features)
    assert extractor.name == name
    assert n > 100
    assert features.points.shape == (n, 2)
    assert features.points.dtype == np.float32
    for array in (features.scales, features.angles, features.responses):
        assert array.shape == (n,)
        assert array.dtype == np.float32
    assert features.frames.shape == (n, 2, 2)
    assert np.all(features.scales > 0)
    assert features.descriptors.shape == (n, LENGTHS[name])
    assert features.descriptors.dtype == (np.float32 if name == "opencv-sift" else np.uint8)
    height, width = image.shape
    assert np.all((features.points >= -0.5) & (features.points <= (width - 0.5, height - 0.5)))


@pytest.mark.parametrize("name", NAMES)
def test_the_same_image_gives_the_same_features(photo, name):
    image = gray(photo("coffee", width=300))
    a, b = make_extractor(name).extract(image), make_extractor(name).extract(image.copy())
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.descriptors, b.descriptors)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "shape", [(1, 1), (5, 5), (1, 200), (200, 1), (2, 640), (7, 640), (8, 640), (480, 640)]
)
def test_an_image_of_one_grey_has_no_features(name, shape):
    features = make_extractor(name).extract(np.full(shape, 128, np.uint8))
    assert len(features) == 0
    assert features.points.shape == (0, 2)
    assert features.descriptors.shape == (0, LENGTHS[name])
    assert (features.descriptors.dtype == np.float32) == (name == "opencv-sift")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("shape", [(1, 1), (5, 5), (1, 200), (200, 1), (7, 7), (8, 3000), (33, 31)])
def test_tiny_images_of_noise_do_no_harm(name, shape):
    image = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    features = make_extractor(name).extract(image)
    assert np.all(np.isfinite(features.descriptors))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "image",
    [
        np.zeros((0, 0), np.uint8),
        np.zeros((0, 9), np.uint8),
        np.zeros((50, 50, 3), np.uint8),
        np.zeros((50, 50), np.float32),
    ],
    ids=["empty", "no rows", "colour", "float"],
)
def test_what_is_not_a_grey_image_is_refused(name, image):
    with pytest.raises(ImageError, match="grey H×W uint8 image, got shape"):
        make_extractor(name).extract(image)


@pytest.mark.parametrize("name", NAMES)
def test_a_part_of_a_larger_array_gives_the_features_of_its_copy(photo, name):
    image = gray(photo("coffee", width=300))[10:, 20:-30]
    a, b = make_extractor(name).extract(image), make_extractor(name).extract(image.copy())
    np.testing.assert_array_equal(a.points, b.points)


def test_an_unknown_name_is_answered_with_those_that_are_known():
    with pytest.raises(InvalidInputError, match="'surfboard'; there are sift, surf, akaze, brisk"):
        make_extractor("surfboard")


def test_rootsift_has_unit_length_and_is_the_root_of_sift(photo):
    image = gray(photo("coffee", width=300))
    root = OpenCVSIFT().extract(image)
    raw = OpenCVSIFT(OpenCVSIFTConfig(root=False)).extract(image)
    np.testing.assert_allclose(np.linalg.norm(root.descriptors, axis=1), 1.0, atol=1e-5)
    l1 = raw.descriptors / raw.descriptors.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(root.descriptors**2, l1, atol=1e-6)


@pytest.mark.parametrize(
    ("extractor", "few"),
    [
        (SIFT, SIFTConfig(max_features=50)),
        (SURF, SURFConfig(max_features=50)),
        (OpenCVSIFT, OpenCVSIFTConfig(max_features=50)),
        (AKAZE, AKAZEConfig(max_features=50)),
        (BRISK, BRISKConfig(max_features=50)),
        (ORB, ORBConfig(max_features=50)),
    ],
)
def test_max_features_is_a_limit(photo, extractor, few):
    image = gray(photo("coffee", width=300))
    # BRISK drops corners at the border of the image after they were counted.
    assert 25 <= len(extractor(few).extract(image)) <= 50


@pytest.mark.parametrize(
    ("more", "fewer"),
    [
        (SIFT(SIFTConfig(contrast_threshold=0.015)), SIFT(SIFTConfig(contrast_threshold=0.06))),
        (SIFT(SIFTConfig(edge_threshold=20)), SIFT(SIFTConfig(edge_threshold=5))),
        (SIFT(SIFTConfig(octave_layers=4)), SIFT(SIFTConfig(octave_layers=1))),
        (SIFT(SIFTConfig(sigma=1.6)), SIFT(SIFTConfig(sigma=2.4))),
        (SURF(SURFConfig(hessian_threshold=5)), SURF(SURFConfig(hessian_threshold=50))),
        (SURF(SURFConfig(octaves=3)), SURF(SURFConfig(octaves=1))),
        (SURF(SURFConfig(octave_layers=4)), SURF(SURFConfig(octave_layers=2))),
        (AKAZE(AKAZEConfig(threshold=5e-4)), AKAZE(AKAZEConfig(threshold=5e-3))),
        (AKAZE(AKAZEConfig(octaves=4)), AKAZE(AKAZEConfig(octaves=1))),
        (AKAZE(AKAZEConfig(octave_layers=4)), AKAZE(AKAZEConfig(octave_layers=1))),
        (BRISK(BRISKConfig(threshold=15)), BRISK(BRISKConfig(threshold=40))),
        (BRISK(BRISKConfig(levels=6)), BRISK(BRISKConfig(levels=1))),
        (ORB(ORBConfig(levels=8)), ORB(ORBConfig(levels=1))),
        (ORB(ORBConfig(fast_threshold=5)), ORB(ORBConfig(fast_threshold=60))),
    ],
    ids=lambda extractor: "",
)
def test_each_setting_does_what_it_says(photo, more, fewer):
    image = gray(photo("coffee", width=300))
    assert len(more.extract(image)) > len(fewer.extract(image))


def test_brisk_on_a_pyramid_recognises_a_smaller_view_that_the_papers_brisk_does_not(photo):
    reference = gray(photo("astronaut", width=400))
    seen = cv2.resize(reference, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)

    def right(brisk):
        a, b = brisk.extract(reference), brisk.extract(seen)
        i, j = mutual_matches(a, b, is_binary=True)
        shift = edge_from_pixel(b.points[j]) - edge_from_pixel(a.points[i]) / 2
        return np.count_nonzero(np.linalg.norm(shift, axis=1) < 1.5)

    assert right(BRISK()) > 4 * right(BRISK(BRISKConfig(levels=1)))


def test_features_refuse_arrays_that_do_not_belong_together():
    good = Features(np.zeros((3, 2)), *[np.ones(3)] * 3, np.zeros((3, 8), np.uint8))
    assert len(good) == 3
    with pytest.raises(InvalidInputError, match="N×2 points"):
        replace(good, points=np.zeros((3, 3)))
    with pytest.raises(InvalidInputError, match=r"3 points and \[3, 3, 3, 2\]"):
        replace(good, descriptors=np.zeros((2, 8), np.uint8))
    with pytest.raises(InvalidInputError, match="one sign a point, got 4 for 3"):
        replace(good, signs=np.ones(4, np.int8))


def test_the_sign_of_sift_tells_dark_blobs_from_bright_ones():
    y, x = np.mgrid[:200, :300]
    blob = np.exp(-((x - 90) ** 2 + (y - 100) ** 2) / (2 * 8**2))
    blob -= np.exp(-((x - 210) ** 2 + (y - 100) ** 2) / (2 * 8**2))
    image = np.rint(128 + 100 * blob).astype(np.uint8)
    for shown, bright_side in ((image, -1), (255 - image, 1)):
        features = SIFT().extract(shown)
        for middle, sign in ((90, bright_side), (210, -bright_side)):
            there = np.linalg.norm(features.points - (middle, 100), axis=1) < 2
            assert np.count_nonzero(there) > 0
            assert np.all(features.signs[there] == sign)


def test_selection_keeps_what_belongs_together():
    numbers = np.arange(5)
    points = np.column_stack([numbers, numbers])
    described = numbers[:, None].astype(np.uint8)
    signs = np.array([1, -1, 0, 1, -1], np.int8)
    features = Features(points, numbers, 2 * numbers, -numbers, described, signs)
    for chosen in (np.array([4, 1]), np.isin(numbers, [1, 4])):
        some = features.select(chosen)
        np.testing.assert_array_equal(some.points[:, 0], some.scales)
        np.testing.assert_array_equal(some.scales, some.angles / 2)
        np.testing.assert_array_equal(some.scales, -some.responses)
        np.testing.assert_array_equal(some.scales, some.descriptors[:, 0])
        assert sorted(some.scales) == [1, 4]
        np.testing.assert_array_equal(some.signs, [-1, -1])
