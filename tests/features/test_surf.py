"""SURF against mahotas, an implementation of its own, on warped photographs."""

import cv2
import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.features import SURF, SURFConfig

MARGIN = 15  # px at the image's border in which neither looks for keypoints
PHOTOS = ("astronaut", "coffee", "immunohistochemistry")


def warped(photo, name, *, turn, scale, tilt):
    """A photograph of 400 px, a warped and noisy copy of it, and the 2×3 between them."""
    gray = cv2.cvtColor(photo(name, width=400), cv2.COLOR_RGB2GRAY)
    height, width = gray.shape
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    A = scale * np.array([[c, -s], [s, c]]) @ np.diag([1 / tilt, 1.0])
    centre = np.array([(width - 1) / 2, (height - 1) / 2])
    M = np.column_stack([A, np.array([255.5, 255.5]) - A @ centre])
    # Three times as fine and then shrunk: what falls between the pixels is averaged.
    fine = 3 * M + np.array([[0, 0, 1], [0, 0, 1]])
    large = cv2.warpAffine(gray, fine, (1536, 1536), flags=cv2.INTER_LINEAR, borderValue=128)
    image = cv2.resize(large, (512, 512), interpolation=cv2.INTER_AREA).astype(float)
    image += np.random.default_rng(turn).normal(0, 3, image.shape)
    return gray, np.clip(np.rint(image), 0, 255).astype(np.uint8), M


def inside(points, size):
    return np.all((points > MARGIN) & (points < np.array(size)[::-1] - 1 - MARGIN), axis=1)


def scores(extract, reference, seen, M):
    """Repeatability within 2.5 px and √1.5 in scale, and right mutual neighbours a keypoint."""
    (a, a_scales, a_descriptors), (b, b_scales, b_descriptors) = extract(reference), extract(seen)
    there = a @ M[:, :2].T + M[:, 2]
    back = (b - M[:, 2]) @ np.linalg.inv(M[:, :2]).T
    keep_a, keep_b = inside(there, seen.shape), inside(back, reference.shape)
    there, a_scales, a_descriptors = there[keep_a], a_scales[keep_a], a_descriptors[keep_a]
    b, b_scales, b_descriptors = b[keep_b], b_scales[keep_b], b_descriptors[keep_b]
    grown = a_scales * np.sqrt(np.linalg.det(M[:, :2]))
    near = np.linalg.norm(there[:, None] - b, axis=2) < 2.5
    near &= np.abs(np.log(grown[:, None] / b_scales)) < np.log(1.5)
    fewer = min(len(there), len(b))
    repeated = min(near.any(axis=0).sum(), near.any(axis=1).sum()) / fewer
    matches = cv2.BFMatcher(cv2.NORM_L2, crossCheck=True).match(
        a_descriptors.astype(np.float32), b_descriptors.astype(np.float32)
    )
    off = [np.linalg.norm(there[m.queryIdx] - b[m.trainIdx]) for m in matches]
    return repeated, np.count_nonzero(np.array(off) < 3) / fewer


def ours(config):
    def extract(image):
        features = SURF(config).extract(image)
        return features.points, features.scales, features.descriptors

    return extract


def theirs(image):
    surf = pytest.importorskip("mahotas.features.surf")
    rows = surf.surf(image, max_points=1500)
    return rows[:, [1, 0]], rows[:, 2], rows[:, 6:]


def mean_scores(photo, extract, **warp):
    return np.mean([scores(extract, *warped(photo, name, **warp)) for name in PHOTOS], axis=0)


@pytest.mark.parametrize(
    "warp",
    [
        {"turn": 10, "scale": 1.0, "tilt": 1.0},
        {"turn": 200, "scale": 0.7, "tilt": 1.0},
        {"turn": 60, "scale": 0.9, "tilt": 1.4},
    ],
    ids=["turned", "smaller", "tilted"],
)
def test_keypoints_and_descriptors_hold_at_least_as_well_as_mahotas(photo, warp):
    pytest.importorskip("mahotas")
    config = SURFConfig(hessian_threshold=6.0)
    repeated, matched = mean_scores(photo, ours(config), **warp)
    their_repeated, their_matched = mean_scores(photo, theirs, **warp)
    assert repeated > their_repeated - 0.02
    assert matched > their_matched - 0.02
    # By chance 2 % would be matched within 3 px of the right place; mahotas may be broken.
    assert matched > 0.2


def test_extended_descriptors_are_about_as_good(photo):
    warp = {"turn": 60, "scale": 0.9, "tilt": 1.4}
    _, plain = mean_scores(photo, ours(SURFConfig()), **warp)
    _, extended = mean_scores(photo, ours(SURFConfig(extended=True)), **warp)
    assert extended > 0.85 * plain


def test_bytes_cost_no_matches(photo):
    """Coarser bytes than ours lose matches only when they are eight times as coarse."""
    warp = {"turn": 60, "scale": 0.9, "tilt": 1.4}

    def coarser(step):
        def extract(image):
            points, scales, descriptors = ours(SURFConfig())(image)
            return points, scales, np.floor_divide(descriptors, step)

        return extract

    fine, half = (mean_scores(photo, coarser(step), **warp)[1] for step in (1, 2))
    assert half == pytest.approx(fine, abs=0.02)
    assert mean_scores(photo, coarser(16), **warp)[1] < fine - 0.02


def test_upright_beats_oriented_where_nothing_is_turned(photo):
    warp = {"turn": 0, "scale": 0.8, "tilt": 1.0}
    oriented = mean_scores(photo, ours(SURFConfig()), **warp)[1]
    upright = mean_scores(photo, ours(SURFConfig(upright=True)), **warp)[1]
    assert upright > oriented
    warp["turn"] = 90
    assert mean_scores(photo, ours(SURFConfig(upright=True)), **warp)[1] < 0.5 * oriented


def test_extended_descriptors_are_twice_as_long(photo):
    image = cv2.cvtColor(photo("coffee", width=300), cv2.COLOR_RGB2GRAY)
    plain = SURF().extract(image)
    extended = SURF(SURFConfig(extended=True)).extract(image)
    assert plain.descriptors.shape == (len(plain), 64)
    assert extended.descriptors.shape == (len(plain), 128)
    np.testing.assert_array_equal(plain.points, extended.points)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"hessian_threshold": -1.0}, "hessian_threshold must be ≥ 0 and finite, got -1"),
        ({"hessian_threshold": float("nan")}, "hessian_threshold must be ≥ 0"),
        ({"octaves": 0}, "octaves must be 1 to 5, got 0"),
        ({"octave_layers": 9}, "octave_layers must be 1 to 4, got 9"),
    ],
)
def test_settings_out_of_range_are_refused(setting, message):
    with pytest.raises(InvalidInputError, match=message):
        SURF(SURFConfig(**setting))
