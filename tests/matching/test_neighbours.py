"""Every matcher against a brute force in plain NumPy."""

import cv2
import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.features import make_extractor
from planegrasp.features.oblique import ObliqueConfig, extract_oblique
from planegrasp.matching.neighbours import MATCHERS, flann_kdtree, flann_lsh, make_matcher

FLOAT_MATCHERS = ["brute-force", "flann-kdtree", "flann-kmeans"]
BINARY_MATCHERS = ["brute-force", "flann-lsh"]
EVERY = [(name, False) for name in FLOAT_MATCHERS] + [(name, True) for name in BINARY_MATCHERS]


def exact(references, queries, k, is_binary):
    """Distances of the k nearest and the whole table of distances."""
    r, q = (
        (np.unpackbits(d, axis=1) if is_binary else d).astype(float) for d in (references, queries)
    )
    square = np.maximum((q * q).sum(axis=1)[:, None] + (r * r).sum(axis=1) - 2 * q @ r.T, 0)
    table = square if is_binary else np.sqrt(square)  # of bits the square of a difference counts
    return np.sort(table, axis=1)[:, :k], table


def random_descriptors(n, is_binary, seed=0):
    rng = np.random.default_rng(seed)
    if is_binary:
        return rng.integers(0, 256, (n, 32)).astype(np.uint8)
    return rng.random((n, 128), dtype=np.float32)


@pytest.fixture(scope="module")
def described(photo):
    """Descriptors as they occur: of a taught face, and of a smaller, blurred, noisy view of it."""

    def describe(is_binary):
        image = cv2.cvtColor(photo("astronaut", width=300), cv2.COLOR_RGB2GRAY)
        seen = cv2.GaussianBlur(cv2.resize(image, None, fx=0.8, fy=0.8), (0, 0), 0.7)
        noise = np.random.default_rng(0).normal(0, 3, seen.shape)
        seen = np.clip(seen + noise, 0, 255).astype(np.uint8)
        extractor = make_extractor("orb" if is_binary else "sift")
        views = ObliqueConfig(tilts=(1.0, 2**0.5, 2.0))
        taught = extract_oblique(extractor, image, views)
        some = extractor.extract(seen).descriptors[::3][:400]
        return taught.descriptors[:6000], some

    both = {is_binary: describe(is_binary) for is_binary in (False, True)}
    return both.__getitem__


@pytest.mark.parametrize("is_binary", [False, True])
@pytest.mark.parametrize("k", [1, 5])
def test_brute_force_is_exact(is_binary, k):
    references = random_descriptors(300, is_binary)
    queries = random_descriptors(70, is_binary, seed=1)
    indices, distances = make_matcher("brute-force", references, binary=is_binary).search(
        queries, k
    )
    expected, table = exact(references, queries, k, is_binary)
    np.testing.assert_allclose(distances, expected, rtol=1e-5)
    rows = np.arange(len(queries))[:, None]
    np.testing.assert_allclose(table[rows, indices], expected, rtol=1e-5)


@pytest.mark.parametrize(
    ("name", "is_binary", "nearest", "among_five"),
    [
        ("brute-force", False, 1.0, 1.0),
        ("brute-force", True, 1.0, 1.0),
        # Of about 6000; most misses are among descriptors that are about equally far.
        ("flann-kdtree", False, 0.8, 0.6),
        ("flann-kmeans", False, 0.9, 0.85),
        ("flann-lsh", True, 0.9, 0.85),
    ],
)
def test_agreement_with_the_exact_neighbours(described, name, is_binary, nearest, among_five):
    references, queries = described(is_binary)
    _, distances = make_matcher(name, references, binary=is_binary).search(queries, 5)
    expected, _ = exact(references, queries, 5, is_binary)
    tolerance = 1e-4 * expected.max()
    first = np.abs(distances[:, 0] - expected[:, 0]) <= tolerance
    five = np.isfinite(distances) & (distances <= expected[:, 4:] + tolerance)
    assert first.mean() >= nearest
    assert five.mean() >= among_five


@pytest.mark.parametrize(("name", "is_binary"), EVERY)
def test_a_reference_finds_itself(name, is_binary):
    references = random_descriptors(2000, is_binary)
    indices, distances = make_matcher(name, references, binary=is_binary).search(
        references[::10], 1
    )
    found = indices[:, 0] == np.arange(0, 2000, 10)
    assert found.mean() >= 0.95
    np.testing.assert_array_equal(distances[found, 0], 0)


@pytest.mark.parametrize(("name", "is_binary"), EVERY)
def test_distances_are_those_of_the_neighbours_and_ascend(described, name, is_binary):
    references, queries = described(is_binary)
    indices, distances = make_matcher(name, references, binary=is_binary).search(queries, 6)
    assert indices.dtype == np.int32
    assert distances.dtype == np.float32
    assert indices.shape == distances.shape == (len(queries), 6)
    _, table = exact(references, queries, 1, is_binary)
    rows = np.arange(len(queries))[:, None]
    known = indices >= 0
    assert known.mean() > 0.5
    true = np.where(known, table[rows, indices], np.inf)
    np.testing.assert_allclose(distances, true, rtol=1e-3, atol=1e-3)
    assert np.all(distances[:, 1:] >= distances[:, :-1])
    for row, kept in zip(indices, known, strict=True):
        assert len(set(row[kept])) == np.count_nonzero(kept)  # none twice


@pytest.mark.parametrize(("name", "is_binary"), EVERY)
def test_two_builds_give_the_same_neighbours(described, name, is_binary):
    references, queries = described(is_binary)
    first = make_matcher(name, references, binary=is_binary).search(queries, 4)
    cv2.setRNGSeed(12345)  # whatever another part of the program did to OpenCV's generator
    make_matcher(name, references[::-1].copy(), binary=is_binary)
    second = make_matcher(name, references, binary=is_binary).search(queries, 4)
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


@pytest.mark.parametrize(("name", "is_binary"), EVERY)
@pytest.mark.parametrize("count", [1, 3])
def test_more_neighbours_than_references_are_none_at_infinity(name, is_binary, count):
    references = random_descriptors(count, is_binary)
    indices, distances = make_matcher(name, references, binary=is_binary).search(references, 5)
    assert indices.shape == distances.shape == (count, 5)
    np.testing.assert_array_equal(indices[:, 0], np.arange(count))
    np.testing.assert_array_equal(indices[:, count:], -1)
    assert np.all(np.isinf(distances[indices < 0]))
    assert np.all(np.isfinite(distances[indices >= 0]))


@pytest.mark.parametrize(("name", "is_binary"), EVERY)
def test_no_queries_have_no_neighbours(name, is_binary):
    references = random_descriptors(50, is_binary)
    indices, distances = make_matcher(name, references, binary=is_binary).search(references[:0], 4)
    assert indices.shape == distances.shape == (0, 4)


@pytest.mark.parametrize(("name", "is_binary"), EVERY)
def test_rows_of_a_larger_array_will_do(name, is_binary):
    references = random_descriptors(400, is_binary)
    plain = make_matcher(name, references[::2].copy(), binary=is_binary).search(
        references[1::2].copy(), 3
    )
    strided = make_matcher(name, references[::2], binary=is_binary).search(references[1::2], 3)
    np.testing.assert_array_equal(plain[0], strided[0])


def test_lsh_finds_nothing_for_what_is_like_none_of_the_references():
    references = np.zeros((20, 32), np.uint8)
    indices, distances = make_matcher("flann-lsh", references, binary=True).search(
        ~references[:3], 2
    )
    np.testing.assert_array_equal(indices, -1)
    assert np.all(np.isinf(distances))


@pytest.mark.parametrize(
    ("name", "is_binary", "instead"),
    [("flann-kdtree", True, "flann-lsh"), ("flann-kmeans", True, "flann-lsh"),
     ("flann-lsh", False, "flann-kdtree")],
)  # fmt: skip
def test_the_wrong_kind_of_descriptor_is_refused_with_what_to_use(name, is_binary, instead):
    with pytest.raises(InvalidInputError, match=f"{name}.*use brute-force or {instead}"):
        make_matcher(name, random_descriptors(20, is_binary), binary=is_binary)


def test_an_unknown_matcher_is_answered_with_those_that_are_known():
    with pytest.raises(InvalidInputError, match="'annoy'; there are brute-force, flann-kdtree"):
        make_matcher("annoy", random_descriptors(5, False), binary=False)
    assert set(MATCHERS) == {*FLOAT_MATCHERS, *BINARY_MATCHERS}


@pytest.mark.parametrize(
    ("build", "is_binary", "good", "poor"),
    [
        (flann_kdtree, False, {"checks": 128}, {"checks": 8}),
        (flann_kdtree, False, {"trees": 8}, {"trees": 1}),
        (MATCHERS["flann-kmeans"], False, {"checks": 256}, {"checks": 16}),
        (flann_lsh, True, {"tables": 20}, {"tables": 2}),
        (flann_lsh, True, {"probes": 2}, {"probes": 0}),
        (flann_lsh, True, {"key_bits": 14}, {"key_bits": 22}),
    ],
)
def test_each_setting_trades_accuracy(described, build, is_binary, good, poor):
    references, queries = described(is_binary)
    expected, _ = exact(references, queries, 1, is_binary)

    def agreement(settings):
        _, distances = build(references, **settings, binary=is_binary).search(queries, 1)
        return np.mean(distances[:, 0] <= expected[:, 0] * 1.0001 + 1e-5)

    assert agreement(good) > agreement(poor) + 0.02
