"""The core's SIFT against what blobs and warps say analytically, and against OpenCV's."""

import copy
import pickle

import cv2
import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.features import SIFT, OpenCVSIFT, SIFTConfig

# A Gaussian blob of σ is an extremum of the difference of Gaussians σ' and kσ' at √k·σ' = σ
# (maximum of the normalised difference); the camera's blur of 0.5 px is assumed to be in it.
K = 2 ** (1 / 3)


def blobs(places, sigma, size=(240, 200), contrast=170.0):
    """Bright blobs on grey; places are (x, y) in pixels."""
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    image = np.full(x.shape, 40.0)
    for cx, cy in places:
        image += contrast * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * sigma**2))
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def gray(image):
    return cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)


@pytest.mark.parametrize("double", [True, False])
@pytest.mark.parametrize("sigma", [3.0, 4.0, 6.0, 9.0, 14.0])
@pytest.mark.parametrize("place", [(100.0, 90.0), (111.5, 87.25), (96.3, 104.8)])
def test_a_blob_is_found_where_it_is_and_as_large_as_it_is(place, sigma, double):
    config = SIFTConfig(double_first_octave=double)
    features = SIFT(config).extract(blobs([place], sigma))
    strongest = np.argmax(features.responses)
    # Grey levels are rounded; the octave of a large blob has pixels of several pixels.
    np.testing.assert_allclose(features.points[strongest], place, atol=0.02 * sigma)
    assert features.scales[strongest] == pytest.approx(2 * sigma / np.sqrt(K), rel=0.06)


def test_the_middle_of_a_mirrored_image_stays_the_middle():
    image = blobs([(60.5, 50.25), (150.75, 120.0)], 4.0, size=(221, 183))
    plain, mirrored = SIFT().extract(image), SIFT().extract(image[::-1, ::-1].copy())
    back = np.array([220, 182]) - mirrored.points
    distance = np.linalg.norm(plain.points[:, None] - back, axis=2).min(axis=1)
    assert len(plain) >= 2
    assert np.median(distance) < 0.01


@pytest.mark.parametrize("degrees", [0, 40, 90, 215, 300])
def test_the_orientation_is_that_of_the_brightest_side(degrees):
    direction = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    image = blobs([(100, 100)], 5.0, contrast=30).astype(float)
    x, y = np.meshgrid(np.arange(240) - 100, np.arange(200) - 100)
    image += np.clip(3.0 * (x * direction[0] + y * direction[1]), -40, 140)
    features = SIFT().extract(np.clip(np.rint(image), 0, 255).astype(np.uint8))
    near = np.linalg.norm(features.points - (100, 100), axis=1) < 4
    error = np.degrees(features.angles[near]) - degrees
    # A blob's own gradients point to its middle from all sides and cancel out.
    assert np.abs((error + 180) % 360 - 180).min() < 6


def test_quarter_turns_turn_everything(photo):
    image = gray(photo("coffee", width=301))
    plain, turned = SIFT().extract(image), SIFT().extract(np.rot90(image).copy())
    # Counterclockwise: (x, y) goes to (y, width - 1 - x), directions lose 90°.
    expected = np.column_stack([plain.points[:, 1], image.shape[1] - 1 - plain.points[:, 0]])
    distance = np.linalg.norm(expected[:, None] - turned.points, axis=2)
    turn = (turned.angles[None] - plain.angles[:, None] + np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
    nearest = np.argmin(distance + np.abs(turn), axis=1)
    rows = np.arange(len(plain))
    same = (distance[rows, nearest] < 0.05) & (np.abs(turn[rows, nearest]) < np.radians(4))
    # Where gradients are sampled does not turn by quarters exactly.
    assert same.mean() > 0.75
    difference = plain.descriptors[same].astype(float) - turned.descriptors[nearest[same]]
    # Unit vectors in units of 1/255: unlike ones are about 150 apart.
    assert np.median(np.linalg.norm(difference, axis=1)) < 15


def test_descriptors_are_unit_vectors_of_seven_bits(photo):
    descriptors = SIFT().extract(gray(photo("coffee", width=300))).descriptors
    assert descriptors.dtype == np.uint8
    assert descriptors.max() <= 127
    length = np.linalg.norm(descriptors.astype(float), axis=1)
    # Rounding shifts each of the 128 values by up to a half, and small ones mostly down.
    np.testing.assert_allclose(length, 255, atol=4)


@pytest.mark.parametrize("size", [(640, 480), (333, 517), (97, 800)])
def test_the_number_of_threads_changes_nothing(photo, size):
    image = cv2.resize(gray(photo("astronaut", width=512)), size)
    one = SIFT(threads=1).extract(image)
    assert len(one) > 100
    for threads in (0, 2, 5):
        more = SIFT(threads=threads).extract(image)
        for name in ("points", "scales", "angles", "responses", "descriptors"):
            np.testing.assert_array_equal(getattr(more, name), getattr(one, name))


def test_what_came_before_changes_nothing(photo):
    images = [gray(photo("coffee", width=w)) for w in (300, 211, 300)]
    images[2] = images[2][::-1].copy()
    used = SIFT()
    for image in [*images, images[0]]:
        again, fresh = used.extract(image), SIFT().extract(image)
        np.testing.assert_array_equal(again.points, fresh.points)
        np.testing.assert_array_equal(again.descriptors, fresh.descriptors)


@pytest.mark.parametrize("shape", [(1, 1), (1, 5000), (5000, 1), (6, 6), (11, 11), (12, 4000)])
def test_odd_sizes_are_no_trouble(shape):
    noise = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    features = SIFT().extract(noise)
    height, width = shape
    assert np.all((features.points >= 0) & (features.points <= (width, height)))


def test_an_image_that_is_too_large_is_refused():
    with pytest.raises(InvalidInputError, match="width must be at most 65536 px, got 70000"):
        SIFT().extract(np.zeros((1, 70000), np.uint8))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"octave_layers": 0}, "octave_layers must be 1 to 8, got 0"),
        ({"max_features": -1}, "max_features must be ≥ 0, got -1"),
        ({"sigma": 0.4}, "sigma must be 1 to 3.2 px, got 0.4"),
        ({"contrast_threshold": float("nan")}, "contrast_threshold must be 0.001 to 1"),
        ({"edge_threshold": 0.5}, "edge_threshold must be"),
    ],
)
def test_impossible_settings_are_refused(settings, message):
    with pytest.raises(InvalidInputError, match=message):
        SIFT(SIFTConfig(**settings))


def test_copies_extract_the_same_and_print_their_settings(photo):
    image = gray(photo("coffee", width=200))
    extractor = SIFT(SIFTConfig(contrast_threshold=0.03), threads=2)
    for twin in (copy.deepcopy(extractor), pickle.loads(pickle.dumps(extractor))):
        assert twin == extractor
        assert twin.threads == 2
        np.testing.assert_array_equal(twin.extract(image).points, extractor.extract(image).points)
    assert "contrast_threshold=0.03" in repr(extractor)


def test_finding_without_doubling_leaves_the_small_ones_out(photo):
    image = gray(photo("coffee", width=300))
    plain = SIFT(SIFTConfig(double_first_octave=False)).extract(image)
    doubled = SIFT().extract(image)
    assert 100 < len(plain) < 0.5 * len(doubled)
    assert plain.scales.min() > 3.2
    assert doubled.scales.min() < 2.2


def warped(image, scale, degrees, tilt):
    """A noisy view of an image and the 3×3 map of pixels into it."""
    height, width = image.shape
    middle = np.array([[1, 0, (width - 1) / 2], [0, 1, (height - 1) / 2], [0, 0, 1]])
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    squeeze = np.diag([np.cos(np.radians(tilt)), 1.0, 1.0])
    similarity = np.array([[scale * c, -scale * s, 0], [scale * s, scale * c, 0], [0, 0, 1]])
    H = middle @ similarity @ squeeze @ np.linalg.inv(middle)
    # Drawn three times as large and averaged, so that nothing is aliased.
    enlarge = np.array([[3.0, 0, 1], [0, 3, 1], [0, 0, 1]])
    large = cv2.warpPerspective(image, enlarge @ H, (3 * width, 3 * height), flags=cv2.INTER_CUBIC)
    seen = cv2.resize(large, (width, height), interpolation=cv2.INTER_AREA)
    noisy = seen + np.random.default_rng(0).normal(0, 3, seen.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8), H


def matching_score(extractor, image, view, H):
    """Shares of keypoints found again, and found again and matched."""
    a, b = extractor.extract(image), extractor.extract(view)
    there = cv2.perspectiveTransform(a.points[None].astype(float), H)[0]
    back = cv2.perspectiveTransform(b.points[None].astype(float), np.linalg.inv(H))[0]
    inside = np.array(image.shape[::-1]) - 6
    a_seen = np.flatnonzero(np.all((there > 5) & (there < inside), axis=1))
    b_seen = np.flatnonzero(np.all((back > 5) & (back < inside), axis=1))
    distance = np.linalg.norm(there[a_seen][:, None] - b.points[b_seen], axis=2)
    growth = np.sqrt(np.abs(np.linalg.det(H)))
    ratio = np.log(growth * a.scales[a_seen][:, None] / b.scales[b_seen])
    right = (distance < 2.0) & (np.abs(ratio) < np.log(1.5))
    total = min(right.shape)
    repeated = min(right.any(axis=0).sum(), right.any(axis=1).sum())
    matches = cv2.BFMatcher(crossCheck=True).match(
        a.descriptors[a_seen].astype(np.float32), b.descriptors[b_seen].astype(np.float32)
    )
    matched = sum(right[m.queryIdx, m.trainIdx] for m in matches)
    return repeated / total, matched / total, len(b)


def test_keypoints_repeat_and_match_as_well_as_those_of_opencv(photo):
    views = [(0.6, 20, 0), (1.5, 70, 0), (1.0, 160, 0), (1.0, 10, 45)]
    scores = {"sift": [], "opencv": []}
    for name in ("astronaut", "coffee", "chelsea"):
        image = gray(photo(name, width=400))
        for view in views:
            seen, H = warped(image, *view)
            for key, extractor in (("sift", SIFT()), ("opencv", OpenCVSIFT())):
                scores[key].append(matching_score(extractor, image, seen, H))
    ours, theirs = np.mean(scores["sift"], axis=0), np.mean(scores["opencv"], axis=0)
    assert theirs[1] > 0.4  # the views are neither trivial nor hopeless
    assert ours[0] > theirs[0] - 0.01
    assert ours[1] > theirs[1] - 0.01
    assert ours[2] == pytest.approx(theirs[2], rel=0.1)
