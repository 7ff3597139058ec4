"""Which descriptors are kept: those that find their own place again in other views."""

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.features import SIFT
from planegrasp.features.oblique import ObliqueConfig, ObliqueFeatures, extract_oblique
from planegrasp.features.pruning import PruningConfig, by_usefulness

FEW = PruningConfig(views=20, max_tilt_deg=60.0)
SAME_PLACE = 6.0


@pytest.fixture(scope="module")
def gray(photo):
    return cv2.cvtColor(photo("astronaut", width=200), cv2.COLOR_RGB2GRAY)


@pytest.fixture(scope="module")
def features(gray):
    return extract_oblique(SIFT(), gray, ObliqueConfig(tilts=(1.0, 2.0)))


@pytest.fixture(scope="module")
def useful(gray, features):
    @cache
    def order(config=FEW):
        return kept_of(features, gray, config)

    return order


def useful_of(features, gray, config=FEW):
    return by_usefulness(features, gray, SIFT(), blur=0.8, same_place=SAME_PLACE, config=config)


def kept_of(features, gray, config=FEW):
    return useful_of(features, gray, config).order


def test_each_is_kept_once_and_most_are_dropped(features, useful):
    kept = useful()
    assert len(set(kept)) == len(kept)
    assert kept.min() >= 0
    assert kept.max() < len(features)
    assert 100 < len(kept) < 0.7 * len(features)


def test_what_cannot_serve_is_dropped(gray, features):
    """Descriptors of noise, those of other places, and their right positions among them."""
    rng = np.random.default_rng(1)
    n = len(features)
    noise = rng.integers(0, 60, features.descriptors.shape).astype(np.uint8)
    moved = (features.points + np.array([70, 50])) % gray.shape[::-1]
    mixed = ObliqueFeatures(
        np.concatenate([features.points, moved, features.points]).astype(np.float32),
        np.concatenate([features.frames] * 3),
        np.concatenate([noise, noise[::-1], features.descriptors]),
        np.concatenate([features.signs] * 3),
    )
    kept = kept_of(mixed, gray)
    assert len(kept) > 100
    assert np.mean(kept >= 2 * n) > 0.99


def test_a_descriptor_that_also_lies_elsewhere_serves_nothing(gray, features):
    twice = ObliqueFeatures(
        np.concatenate([features.points, features.points[::-1]]),
        np.concatenate([features.frames] * 2),
        np.concatenate([features.descriptors] * 2),
        np.concatenate([features.signs] * 2),
    )
    # What is 2 px off a place is still right there, on top of what counts as one place.
    apart = np.linalg.norm(features.points - features.points[::-1], axis=1)
    far = apart > SAME_PLACE + 10
    assert np.count_nonzero(far) > 100
    kept = kept_of(twice, gray)
    # Equally near to two places is as ambiguous as can be.
    assert len(kept) > 0
    assert not np.any(far[kept % len(features)])


def test_the_most_useful_come_first(gray, features, useful):
    """The first hundred find more of a view that was not among the trials than the last do."""
    kept = useful()
    small = cv2.GaussianBlur(cv2.resize(gray, None, fx=0.7, fy=0.7), (0, 0), 0.7)
    seen = SIFT().extract(small)
    true = (seen.points + 0.5) / 0.7 - 0.5

    def found(some):
        distance = np.linalg.norm(
            features.descriptors[some].astype(np.float32)
            - seen.descriptors.astype(np.float32)[:, None],
            axis=2,
        )
        nearest = some[distance.argmin(axis=1)]
        off = np.linalg.norm(features.points[nearest] - true, axis=1)
        return np.count_nonzero((off < 3) & (distance.min(axis=1) < 250))

    assert found(kept[:100]) > 1.2 * found(kept[-100:])


def test_fewer_descriptors_are_the_first_of_more(useful):
    everything = useful()
    np.testing.assert_array_equal(useful(replace(FEW, max_descriptors=50)), everything[:50])


def test_the_seed_decides(gray, features, useful):
    again = kept_of(features, gray)
    np.testing.assert_array_equal(again, useful())
    other = useful(replace(FEW, seed=1))
    assert not np.array_equal(other[:50], useful()[:50])
    # Other trial views, but the same face.
    assert len(np.intersect1d(other, useful())) > 0.5 * len(useful())


def test_a_weakly_textured_face_serves_few_features_of_its_poor_views(photo):
    served = {}
    for name in ("astronaut", "rocket"):
        gray = cv2.cvtColor(photo(name, width=200), cv2.COLOR_RGB2GRAY)
        features = extract_oblique(SIFT(), gray, ObliqueConfig(tilts=(1.0, 2.0)))
        served[name] = useful_of(features, gray).served
        # Fewer descriptors cannot serve more.
        few = useful_of(features, gray, replace(FEW, max_descriptors=50)).served
        assert few <= served[name]
    assert 0 <= served["rocket"] < 0.5 * served["astronaut"]


def test_a_face_without_texture_keeps_nothing():
    flat = np.full((80, 100), 128, np.uint8)
    none = extract_oblique(SIFT(), flat, ObliqueConfig(tilts=(1.0,)))
    kept = useful_of(none, flat)
    assert len(kept.order) == 0
    assert kept.served == 0.0


def test_descriptors_of_floats_are_refused(gray, features):
    floats = replace(features, descriptors=features.descriptors.astype(np.float32))
    with pytest.raises(InvalidInputError, match="only descriptors of bytes can be pruned"):
        kept_of(floats, gray)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"max_descriptors": -1}, "max_descriptors ≥ 0"),
        ({"views": 0}, "views ≥ 1"),
        ({"max_tilt_deg": 90.0}, "max_tilt_deg < 90"),
        ({"max_tilt_deg": -1.0}, "0 ≤ max_tilt_deg"),
        ({"min_scale": 0.0}, "0 < min_scale"),
        ({"min_scale": 1.1}, "min_scale ≤ 1"),
        ({"noise": -1.0}, "noise ≥ 0"),
        ({"noise": np.nan}, "noise ≥ 0"),
    ],
)
def test_wrong_settings_are_refused(wrong, message):
    with pytest.raises(InvalidInputError, match=message):
        PruningConfig(**wrong)
