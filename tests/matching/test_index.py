"""The ratio test by hand-made descriptors: distances along one axis can be read off."""

from dataclasses import replace

import numpy as np
import pytest

from planegrasp.features import Features
from planegrasp.matching.index import ReferenceSet, make_index

RADIUS = 5.0


def descriptor(*values):
    """Vectors along one axis: the distance of two is the difference of their values."""
    return np.array([[v, 0.0, 0.0, 0.0] for v in values], np.float32)


def reference(points, values):
    points = np.asarray(points, np.float32).reshape(-1, 2)
    frames = np.broadcast_to(np.eye(2, dtype=np.float32), (len(points), 2, 2))
    return ReferenceSet(points, frames, descriptor(*values).reshape(-1, 4), RADIUS)


def features(*values):
    n = len(values)
    one = np.ones(n, np.float32)
    points = np.column_stack([100 + 10 * np.arange(n), np.full(n, 50)]).astype(np.float32)
    return Features(points, one, one, one, descriptor(*values).reshape(-1, 4))


def candidates(faces, seen, k=4, matcher="brute-force", binary=False):
    return make_index(faces, matcher, binary=binary).look(seen, k).candidates


def test_the_ratio_is_to_the_nearest_descriptor_elsewhere_on_the_face():
    face = reference([(10, 10), (12, 10), (90, 90)], [1.0, 2.0, 4.0])
    found = candidates([face], features(0.0))
    # The second is 2 px beside the first, the same place; the third is elsewhere.
    assert found.ratio[0] == pytest.approx(1 / 4)
    np.testing.assert_array_equal(found.reference[:, :3], [[0, 1, 2]])
    np.testing.assert_allclose(found.distances, [[1, 2, 4, np.inf]])


def test_beyond_the_radius_is_elsewhere():
    for apart, expected in ((RADIUS - 0.01, 1 / 4), (RADIUS + 0.01, 1 / 2)):
        face = reference([(10, 10), (10 + apart, 10), (90, 90)], [1.0, 2.0, 4.0])
        assert candidates([face], features(0.0)).ratio[0] == pytest.approx(expected)


def test_the_same_position_on_another_face_is_elsewhere():
    faces = [reference([(10, 10)], [1.0]), reference([(10, 10), (10, 10)], [2.0, 3.0])]
    found = candidates(faces, features(0.0, 2.9))
    np.testing.assert_array_equal(found.face[:, 0], [0, 1])
    assert found.ratio[0] == pytest.approx(1 / 2)
    assert found.ratio[1] == pytest.approx(0.1 / 1.9, rel=1e-5)


def test_each_face_has_its_own_radius():
    near = [(10, 10), (18, 10), (90, 90)]
    narrow, wide = reference(near, [1.0, 2.0, 4.0]), reference(near, [101.0, 102.0, 104.0])
    wide = ReferenceSet(wide.points, wide.frames, wide.descriptors, radius=10.0)
    found = candidates([narrow, wide], features(0.0, 100.0))
    np.testing.assert_allclose(found.ratio, [1 / 2, 1 / 4])


def test_where_all_neighbours_are_at_one_place_the_ratio_is_zero():
    points = [*(np.full((16, 2), 10.0) + np.linspace(0, 3, 16)[:, None]), (90, 90)]
    face = reference(points, np.arange(1.0, 18.0))
    assert candidates([face], features(0.0), k=4).ratio[0] == 0.0
    assert candidates([face], features(0.0), k=17).ratio[0] == pytest.approx(1 / 17)


def test_the_ratio_looks_beyond_the_neighbours_that_are_asked_for():
    face = reference([(10, 10), (11, 10), (90, 90)], [1.0, 2.0, 4.0])
    found = candidates([face], features(0.0), k=2)
    np.testing.assert_array_equal(found.reference, [[0, 1]])
    assert found.ratio[0] == pytest.approx(1 / 4)


def test_equally_near_descriptors_at_two_places_have_ratio_one():
    face = reference([(10, 10), (90, 90)], [1.0, 1.0])
    assert candidates([face], features(0.0)).ratio[0] == pytest.approx(1.0)
    # Also where the feature is exactly like both, as on a printed pattern that repeats.
    assert candidates([face], features(1.0)).ratio[0] >= 1.0


def test_neighbours_are_counted_within_their_face():
    faces = [
        reference([(10, 10), (90, 90)], [0.0, 10.0]),
        reference([(5, 5), (80, 80)], [20.0, 30.0]),
    ]
    # Next to the first; between the two of face 0; next to the first of face 1.
    found = candidates(faces, features(1.0, 4.9, 21.0), k=2)
    np.testing.assert_array_equal(found.face, [[0, 0], [0, 0], [1, 1]])
    np.testing.assert_array_equal(found.reference, [[0, 1], [0, 1], [0, 1]])
    np.testing.assert_allclose(found.ratio, [1 / 9, 4.9 / 5.1, 1 / 9], rtol=1e-6)
    assert len(found) == 3
    assert found.face.dtype == found.reference.dtype == np.int32
    assert found.distances.dtype == found.ratio.dtype == np.float32


def test_features_without_any_neighbour_are_of_no_face():
    zeros = np.zeros((12, 32), np.uint8)
    points = np.arange(24, dtype=np.float32).reshape(12, 2)
    frames = np.broadcast_to(np.eye(2, dtype=np.float32), (12, 2, 2))
    face = ReferenceSet(points, frames, zeros, RADIUS)
    one = np.ones(2, np.float32)
    seen = Features(np.ones((2, 2), np.float32), one, one, one, np.full((2, 32), 255, np.uint8))
    found = candidates([face], seen, matcher="flann-lsh", binary=True)
    np.testing.assert_array_equal(found.face, -1)
    assert np.all(found.ratio == np.inf)


def test_no_features_have_no_candidates():
    found = candidates([reference([(10, 10)], [1.0])], features())
    assert found.face.shape == found.reference.shape == found.distances.shape == (0, 4)
    assert found.ratio.shape == (0,)


def test_more_neighbours_than_references_are_of_no_face():
    found = candidates([reference([(10, 10), (90, 90)], [1.0, 2.0])], features(0.0), k=5)
    np.testing.assert_array_equal(found.face, [[0, 0, -1, -1, -1]])
    assert found.ratio[0] == pytest.approx(1 / 2)


def test_a_face_without_features_takes_no_part():
    empty = reference(np.zeros((0, 2)), [])
    faces = [empty, reference([(10, 10)], [1.0]), empty, reference([(20, 20)], [5.0])]
    found = candidates(faces, features(0.0, 6.0))
    np.testing.assert_array_equal(found.face, [[1, 3, -1, -1], [3, 1, -1, -1]])


def most_useful_first(count, served=0.0):
    """A face of so many descriptors of bytes, each at a place of its own."""
    rng = np.random.default_rng(count)
    points = np.column_stack([np.arange(count) * 20.0, np.zeros(count)]).astype(np.float32)
    frames = np.broadcast_to(np.eye(2, dtype=np.float32), (count, 2, 2))
    descriptors = rng.integers(0, 180, (count, 128)).astype(np.uint8)
    return ReferenceSet(points, frames, descriptors, RADIUS, served)


def seen_of(*faces):
    """Features that look like all descriptors of some faces, a little changed."""
    descriptors = np.concatenate([face.descriptors for face in faces])
    one = np.ones(len(descriptors), np.float32)
    points = np.zeros((len(descriptors), 2), np.float32)
    return Features(points, one, one, one, descriptors ^ 1)


def test_a_first_look_is_at_the_first_descriptors_and_a_closer_one_at_all():
    # The core counts in blocks of 32.
    sizes = [100, 32, 70]
    faces = [most_useful_first(size) for size in sizes]
    index = make_index(faces, "native", binary=False, first=32)
    seen = seen_of(*faces)
    truth = np.repeat([0, 1, 2], sizes), np.concatenate([np.arange(size) for size in sizes])
    look = index.look(seen, 4)
    np.testing.assert_array_equal(look.faces, [0, 1, 2])
    assert np.all(look.candidates.reference < 32)
    among_first = truth[1] < 32
    sure = look.candidates.ratio < 0.5
    np.testing.assert_array_equal(sure, among_first)
    np.testing.assert_array_equal(look.candidates.face[sure, 0], truth[0][sure])
    np.testing.assert_array_equal(look.candidates.reference[sure, 0], truth[1][sure])
    assert look.closer == (100,)
    closer = index.look_closer(seen, 4, np.array([0, 2], np.uint32), 100)
    sure = closer.ratio < 0.5
    np.testing.assert_array_equal(sure, truth[0] != 1)
    np.testing.assert_array_equal(closer.face[sure, 0], truth[0][sure])
    np.testing.assert_array_equal(closer.reference[sure, 0], truth[1][sure])
    assert not np.any(closer.face == 1)


@pytest.mark.parametrize(("first", "closer"), [(0, ()), (100, ()), (64, (100,))])
def test_a_closer_look_is_offered_where_it_could_find_more(first, closer):
    faces = [most_useful_first(100), most_useful_first(20)]
    seen = seen_of(*faces)
    index = make_index(faces, "native", binary=False, first=first)
    look = index.look(seen, 4)
    assert look.closer == closer
    whole = index.look_closer(seen, 4, look.faces, 100)
    same = np.array_equal(whole.reference, look.candidates.reference)
    assert same is not bool(closer)


@pytest.mark.parametrize(("count", "first"), [(1, 800), (2, 800), (3, 608), (6, 320), (14, 288)])
def test_of_many_faces_a_first_look_is_at_fewer_descriptors_each(count, first):
    # 1800 in all and at least 280 of each, rounded up to the core's blocks of 32.
    faces = [most_useful_first(900 + number) for number in range(count)]
    look = make_index(faces, "native", binary=False, first=800).look(seen_of(*faces), 2)
    # Then at as many as of few faces, if these are many more, and at all.
    assert look.closer == ((800, 899 + count) if first < 500 else (899 + count,))
    for face in look.faces:
        known = look.candidates.reference[look.candidates.face == face]
        assert known.max() == first - 1


def test_a_first_look_is_at_more_descriptors_of_weakly_textured_faces():
    served = [70.0, 30.0, 10.0, 150.0]
    faces = [most_useful_first(900 + i, served) for i, served in enumerate(served)]
    look = make_index(faces, "native", binary=False, first=800).look(seen_of(*faces), 2)
    known = [look.candidates.reference[look.candidates.face == face].max() + 1 for face in range(4)]
    # Of 1800, as 1/80 to 1/40, 1/20 and 1/160; at least 100 and at most 800, in blocks of 32.
    np.testing.assert_array_equal(known, [256, 480, 800, 128])
    # The poorest has had as many as a closer look would have first.
    assert look.closer == (800, 903)


def test_other_matchers_look_once():
    faces = [most_useful_first(60), most_useful_first(20)]
    seen = seen_of(*faces)
    index = make_index(faces, "brute-force", binary=False, first=10)
    look = index.look(seen, 2)
    assert look.closer == ()
    np.testing.assert_array_equal(look.candidates.reference[:, 0], np.r_[:60, :20])
    again = index.look_closer(seen, 2, np.array([0], np.uint32), 10)
    np.testing.assert_array_equal(again.reference, look.candidates.reference)


def test_of_a_large_library_what_agrees_on_its_place_is_looked_at():
    rng = np.random.default_rng(0)

    def drawn(n):
        points = rng.uniform(0, 400, (n, 2))
        scales, angles = rng.uniform(2, 20, n), rng.uniform(0, 6, n)
        parts = (a.astype(np.float32) for a in (points, scales, angles, np.ones(n)))
        return Features(*parts, rng.integers(0, 256, (n, 32)).astype(np.uint8))

    taught = [drawn(3000) for _ in range(15)]
    faces = [
        ReferenceSet(f.points, f.frames.astype(np.float32), f.descriptors, RADIUS) for f in taught
    ]
    index = make_index(faces, "", binary=False, first=800)
    # Six keypoints of one of them, half as large and turned by 1 rad.
    some = taught[4].select(np.arange(6))
    c, s = np.cos(1.0), np.sin(1.0)
    seen = Features(
        (0.5 * some.points @ np.array([[c, s], [-s, c]]) + 100).astype(np.float32),
        0.5 * some.scales,
        some.angles + np.float32(1.0),
        some.responses,
        some.descriptors,
    )
    np.testing.assert_array_equal(index.look(seen, 4).faces, [4])
    assert index.look(seen, 4).candidates.face[:, 0].tolist() == 6 * [4]
    turned = replace(seen, angles=some.angles[::-1] + np.arange(6, dtype=np.float32))
    nothing = index.look(turned, 4)
    assert len(nothing.faces) == 0
    assert np.all(nothing.candidates.face == -1)
