"""The core's index through its bindings, against plain NumPy."""

import numpy as np
import pytest

from planegrasp import _core
from planegrasp.errors import InvalidInputError


def face(n, length, seed):
    """Points and descriptors."""
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 4, (n, 2)).astype(np.float32) * 10
    return points, rng.integers(0, 128, (n, length)).astype(np.uint8)


def upright(n):
    return np.tile(np.eye(2, dtype=np.float32), (n, 1, 1))


def index_of(faces, length, radius, *, is_binary=False):
    index = _core.ReferenceIndex(length, is_binary=is_binary)
    for number, (points, descriptors) in enumerate(faces):
        assert index.add(points, upright(len(points)), descriptors, radius) == number
    assert len(index) == len(faces)
    return index


def keypoints(n):
    """Points, scales and angles."""
    rng = np.random.default_rng(n)
    points, scales, angles = rng.uniform(0, 480, (n, 2)), rng.uniform(2, 9, n), rng.uniform(0, 6, n)
    return tuple(a.astype(np.float32) for a in (points, scales, angles))


def candidates(index, queries, k):
    among = index.propose(queries, *keypoints(len(queries)))
    return index.candidates(queries, k, among=among)


def plain(faces, queries, radius, *, is_binary):
    """All distances to each query, sorted, with face and reference, and the ratios."""
    number = np.concatenate([np.full(len(f[0]), i) for i, f in enumerate(faces)])
    reference = np.concatenate([np.arange(len(f[0])) for f in faces])
    points = np.concatenate([f[0] for f in faces])
    d = np.concatenate([f[1] for f in faces])
    if is_binary:
        distance = np.bitwise_count(queries[:, None] ^ d).sum(axis=2).astype(float)
    else:
        distance = np.sqrt(((queries[:, None].astype(float) - d) ** 2).sum(axis=2))
    order = np.argsort(distance, axis=1, kind="stable")
    ratio = []
    for row, by_distance in zip(distance, order, strict=True):
        first = by_distance[0]
        apart = np.linalg.norm(points - points[first], axis=1) > radius
        ratio.append(row[first] / row[(number != number[first]) | apart].min())
    return number[order], reference[order], np.take_along_axis(distance, order, 1), ratio


@pytest.mark.parametrize(("is_binary", "length"), [(False, 128), (False, 64), (True, 61)])
def test_neighbours_and_ratios_are_those_of_plain_numpy(is_binary, length):
    faces = [face(n, length, seed) for seed, n in enumerate((300, 1, 0, 77))]
    queries = face(45, length, 9)[1]
    found = candidates(index_of(faces, length, 12.0, is_binary=is_binary), queries, 6)
    number, reference, distance, ratio = plain(faces, queries, 12.0, is_binary=is_binary)
    np.testing.assert_array_equal(found[0], number[:, :6])
    np.testing.assert_array_equal(found[1], reference[:, :6])
    np.testing.assert_allclose(found[2], distance[:, :6], rtol=1e-6)
    np.testing.assert_allclose(found[3], ratio, rtol=1e-6)
    assert [a.dtype for a in found] == [np.int32, np.int32, np.float32, np.float32]


def test_strided_arrays_will_do():
    faces = [face(200, 32, 1)]
    whole = index_of([tuple(a[::2].copy() for a in faces[0])], 32, 1.0)
    strided = index_of([tuple(a[::2] for a in faces[0])], 32, 1.0)
    queries = face(60, 64, 2)[1]
    expected = candidates(whole, queries[:, ::2].copy(), 3)
    for a, b in zip(candidates(strided, queries[:, ::2], 3), expected, strict=True):
        np.testing.assert_array_equal(a, b)


def test_missing_neighbours_are_minus_one_at_infinity():
    queries = face(3, 16, 0)[1]
    number, reference, distance, ratio = candidates(index_of([], 16, 1.0), queries, 2)
    np.testing.assert_array_equal(number, np.full((3, 2), -1))
    np.testing.assert_array_equal(reference, np.full((3, 2), -1))
    assert np.all(np.isinf(distance))
    assert np.all(np.isinf(ratio))


def test_a_removed_face_is_found_no_more_and_cannot_be_removed_again():
    faces = [face(30, 16, seed) for seed in range(3)]
    index = index_of(faces, 16, 1.0)
    assert np.all(candidates(index, faces[1][1], 1)[0] == 1)
    index.remove(1)
    assert np.all(np.isin(candidates(index, faces[1][1], 8)[0], (0, 2)))
    with pytest.raises(InvalidInputError, match=r"face 1 is not in the index.* 3 faces"):
        index.remove(1)


def test_only_the_faces_and_the_first_descriptors_asked_for_are_looked_at():
    faces = [face(100, 16, seed) for seed in range(3)]
    index = index_of(faces, 16, 1.0)
    among = np.array([2, 0], np.uint32)
    first = np.array([40, 7], np.uint32)
    number, reference, *_ = index.candidates(faces[2][1], 150, among=among, first=first)
    # Rounded up to whole blocks of 32: two of the last face, one of the first.
    assert set(number.ravel()) == {-1, 0, 2}
    assert set(reference[number == 2]) == set(range(64))
    assert set(reference[number == 0]) == set(range(32))
    with pytest.raises(InvalidInputError, match="a number for each of the 2 faces, got 1"):
        index.candidates(faces[2][1], 150, among=among, first=first[:1])
    with pytest.raises(InvalidInputError, match="face 3 is not in the index"):
        index.candidates(faces[2][1], 1, among=np.array([3], np.uint32))


def test_only_references_of_a_querys_sign_are_looked_at():
    points, descriptors = face(100, 16, 0)
    signs = np.where(np.arange(100) % 3 > 0, 1, -1).astype(np.int8)
    index = _core.ReferenceIndex(16, is_binary=False)
    index.add(points, upright(100), descriptors, 1.0, signs)
    among = np.zeros(1, np.uint32)
    for asked in (signs, -signs):
        _, reference, distance, _ = index.candidates(descriptors, 1, among=among, signs=asked)
        np.testing.assert_array_equal(signs[reference[:, 0]], asked)
        # Each finds itself where it may.
        np.testing.assert_array_equal(distance[:, 0] == 0, asked == signs)
    unknown = index.candidates(descriptors, 1, among=among)[0]
    np.testing.assert_array_equal(unknown, np.full((100, 1), -1))
    with pytest.raises(InvalidInputError, match="100 descriptors and 7 signs"):
        index.candidates(descriptors, 1, among=among, signs=signs[:7])
    with pytest.raises(InvalidInputError, match="sign must be -1, 0 or 1, got 2"):
        index.add(points, upright(100), descriptors, 1.0, 2 * np.abs(signs))


def test_a_large_library_proposes_what_is_seen_in_one_piece():
    rng = np.random.default_rng(0)
    index = _core.ReferenceIndex(32, is_binary=False)
    taught = []
    for _ in range(15):
        points = rng.uniform(0, 400, (3000, 2)).astype(np.float32)
        descriptors = rng.integers(0, 256, (3000, 32)).astype(np.uint8)
        angles, scales = rng.uniform(0, 2 * np.pi, 3000), rng.uniform(2, 20, 3000)
        cosine, sine = scales * np.cos(angles), scales * np.sin(angles)
        frames = np.stack([cosine, -sine, sine, cosine], axis=1).reshape(-1, 2, 2)
        index.add(points, frames.astype(np.float32), descriptors, 10.0)
        taught.append((points, descriptors, scales, angles))
    points, descriptors, scales, angles = (a[:6] for a in taught[4])
    # Turned by 1 rad, half as large.
    c, s = np.cos(1.0), np.sin(1.0)
    seen = 0.5 * points @ np.array([[c, s], [-s, c]]) + 100
    placed = [a.astype(np.float32) for a in (seen, 0.5 * scales, angles + 1.0)]
    np.testing.assert_array_equal(index.propose(descriptors, *placed), [4])
    # The same descriptors, each where another view of the face would have it.
    steps = np.arange(6, dtype=np.float32)
    seen, scales, angles = placed
    for elsewhere in (
        (seen + 1000 * steps[:, None], scales, angles),
        (seen, scales * 4**steps, angles),
        (seen, scales, angles + steps),
    ):
        assert len(index.propose(descriptors, *elsewhere)) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": np.zeros((5, 3), np.float32)}, r"points must be N rows of shape \[2\]"),
        ({"descriptors": np.zeros((5, 9), np.uint8)}, r"descriptors must be N×8, got .*\[5, 9\]"),
        ({"descriptors": np.zeros((4, 8), np.uint8)}, "5 keypoints need 5 descriptors"),
        ({"frames": np.zeros((5, 4), np.float32)}, r"frames must be N rows of shape \[2, 2\]"),
        ({"frames": np.zeros((4, 2, 2), np.float32)}, "each keypoint needs a frame, got 5 and 4"),
        ({"frames": np.full((5, 2, 2), np.nan, np.float32)}, "frames must be finite"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(change, message):
    points, descriptors = face(5, 8, 0)
    arrays = {"points": points, "frames": upright(5), "descriptors": descriptors} | change
    with pytest.raises(InvalidInputError, match=message):
        _core.ReferenceIndex(8, is_binary=False).add(**arrays, radius=1.0)


def test_impossible_searches_are_refused():
    with pytest.raises(InvalidInputError, match="at least 1 byte"):
        _core.ReferenceIndex(0, is_binary=False)
    index = _core.ReferenceIndex(8, is_binary=False)
    with pytest.raises(InvalidInputError, match="k must be at least 1"):
        candidates(index, np.zeros((1, 8), np.uint8), 0)
    with pytest.raises(InvalidInputError, match="2 points, 2 scales and 3 angles"):
        index.propose(np.zeros((2, 8), np.uint8), *keypoints(2)[:2], keypoints(3)[2])
    for wrong in (0, 1, 2):
        arrays = list(keypoints(2))
        arrays[wrong] = arrays[wrong][None]
        with pytest.raises(InvalidInputError, match="must be N rows of shape"):
            index.propose(np.zeros((2, 8), np.uint8), *arrays)
    with pytest.raises(InvalidInputError, match="3 keypoints need 3 descriptors"):
        index.propose(np.zeros((2, 8), np.uint8), *keypoints(3))
