"""The ratio test by hand-made descriptors: distances along one axis can be read off."""

import numpy as np
import pytest

from planegrasp.features import Features
from planegrasp.matching.index import ReferenceIndex, ReferenceSet

RADIUS = 5.0


def descriptor(*values):
    """Vectors along one axis: the distance of two is the difference of their values."""
    return np.array([[v, 0.0, 0.0, 0.0] for v in values], np.float32)


def reference(points, values, scale=1.0):
    points = np.asarray(points, np.float32).reshape(-1, 2)
    frames = np.broadcast_to(scale * np.eye(2, dtype=np.float32), (len(points), 2, 2))
    return ReferenceSet(points, frames, descriptor(*values).reshape(-1, 4), RADIUS)


def features(*values, scale=1.0, angle=0.0):
    n = len(values)
    one = np.ones(n, np.float32)
    points = np.column_stack([100 + 10 * np.arange(n), np.full(n, 50)]).astype(np.float32)
    return Features(points, scale * one, angle * one, one, descriptor(*values).reshape(-1, 4))


def candidates(faces, seen, k=4, matcher="brute-force", binary=False):
    return ReferenceIndex(faces, matcher, binary=binary).candidates(
        seen, seen.points.astype(float), k
    )


def test_the_ratio_is_to_the_nearest_descriptor_elsewhere_on_the_face():
    face = reference([(10, 10), (12, 10), (90, 90)], [1.0, 2.0, 4.0])
    found = candidates([face], features(0.0))
    # The second is 2 px beside the first, the same place; the third is elsewhere.
    assert found.ratio[0] == pytest.approx(1 / 4)
    np.testing.assert_array_equal(found.points[0, 0], (10, 10))


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
    face = reference([(10, 10), (11, 10), (10, 12), (90, 90)], [1.0, 2.0, 3.0, 4.0])
    assert candidates([face], features(0.0), k=3).ratio[0] == 0.0
    assert candidates([face], features(0.0), k=4).ratio[0] > 0.0


def test_equally_near_descriptors_at_two_places_have_ratio_one():
    face = reference([(10, 10), (90, 90)], [1.0, 1.0])
    assert candidates([face], features(0.0)).ratio[0] == pytest.approx(1.0)
    # Also where the feature is exactly like both, as on a printed pattern that repeats.
    assert candidates([face], features(1.0)).ratio[0] >= 1.0


def test_matches_are_of_one_face_and_pass_the_ratio_test():
    faces = [
        reference([(10, 10), (90, 90)], [0.0, 10.0]),
        reference([(5, 5), (80, 80)], [20.0, 30.0]),
    ]
    # Next to the first; between the two of face 0; next to the first of face 1.
    found = candidates(faces, features(1.0, 4.9, 21.0))
    first, second = found.matches(0, 0.8), found.matches(1, 0.8)
    np.testing.assert_array_equal(first.query, [0])
    np.testing.assert_array_equal(first.reference_points, [(10, 10)])
    np.testing.assert_array_equal(first.image_points, [(100, 50)])
    assert first.ratio[0] == pytest.approx(1 / 9)
    np.testing.assert_array_equal(second.query, [2])
    np.testing.assert_array_equal(found.matches(0, 1.0).query, [0, 1])


def test_features_without_any_neighbour_match_nothing():
    zeros = np.zeros((12, 32), np.uint8)
    points = np.arange(24, dtype=np.float32).reshape(12, 2)
    frames = np.broadcast_to(np.eye(2, dtype=np.float32), (12, 2, 2))
    face = ReferenceSet(points, frames, zeros, RADIUS)
    one = np.ones(2, np.float32)
    seen = Features(np.ones((2, 2), np.float32), one, one, one, np.full((2, 32), 255, np.uint8))
    found = candidates([face], seen, matcher="flann-lsh", binary=True)
    np.testing.assert_array_equal(found.face, -1)
    assert np.all(found.ratio == np.inf)
    assert len(found.matches(0, 1.0)) == 0
    assert len(found.agreeing(0, np.eye(3), 1e9)) == 0


def test_no_features_have_no_candidates():
    found = candidates([reference([(10, 10)], [1.0])], features())
    assert found.face.shape == (0, 4)
    assert len(found.matches(0, 1.0)) == 0


def test_more_neighbours_than_references_are_of_no_face():
    found = candidates([reference([(10, 10), (90, 90)], [1.0, 2.0])], features(0.0), k=5)
    np.testing.assert_array_equal(found.face, [[0, 0, -1, -1, -1]])
    assert found.ratio[0] == pytest.approx(1 / 2)


def test_a_face_without_features_takes_no_part():
    empty = reference(np.zeros((0, 2)), [])
    faces = [empty, reference([(10, 10)], [1.0]), empty, reference([(20, 20)], [5.0])]
    index = ReferenceIndex(faces, "brute-force", binary=False)
    assert len(index) == 2
    found = candidates(faces, features(0.0, 6.0))
    np.testing.assert_array_equal(found.face[:, 0], [1, 3])


def test_agreeing_matches_are_those_that_the_homography_explains():
    # Reference points 0 … 3 on a line; the map takes (x, y) to (2x + 100, y + 50).
    H = np.array([[2.0, 0, 100], [0, 1, 50], [0, 0, 1]])
    face = reference([(0, 0), (5, 0), (10, 0), (40, 0)], [0.0, 10.0, 20.0, 30.0])
    # Seen at 100, 110, 120: the third looks more like the wrong point, but the right one is second.
    seen = features(0.0, 10.0, 25.5)
    found = candidates([face], seen)
    agreeing = found.agreeing(0, H, 0.5)
    np.testing.assert_array_equal(agreeing.query, [0, 1, 2])
    np.testing.assert_array_equal(agreeing.reference_points[:, 0], [0, 5, 10])
    assert len(found.agreeing(0, H + np.array([[0, 0, 0.6], [0, 0, 0], [0, 0, 0]]), 0.5)) == 0
    assert len(found.agreeing(1, H, 0.5)) == 0


def test_points_behind_the_camera_do_not_agree():
    H = np.array([[2.0, 0, 100], [0, 1, 50], [0, 0, 1]])
    found = candidates([reference([(0, 0)], [0.0])], features(0.0))
    assert len(found.agreeing(0, H, 0.5)) == 1
    assert len(found.agreeing(0, -H, 0.5)) == 0


def test_without_drops_features_everywhere():
    face = reference([(0, 0), (50, 0)], [0.0, 10.0])
    found = candidates([face], features(0.0, 10.0, 9.0))
    rest = found.without(np.array([True, False, False]))
    np.testing.assert_array_equal(rest.image_points[:, 0], [110, 120])
    np.testing.assert_array_equal(rest.matches(0, 0.8).reference_points[:, 0], [50, 50])
    assert len(found.without(np.ones(3, bool)).matches(0, 1.0)) == 0


def test_the_local_map_of_a_match_is_from_the_reference_to_the_frame():
    face = reference([(0, 0)], [0.0], scale=2.0)
    (local,) = candidates([face], features(0.0, scale=6.0, angle=np.pi / 2)).matches(0, 1.0).affine
    # Three times larger, turned from x towards y.
    np.testing.assert_allclose(local, [[0, -3], [3, 0]], atol=1e-6)
