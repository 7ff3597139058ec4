import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.homography import HomographyConfig, apply_homography, reference_corners


def test_points_are_mapped_with_perspective():
    H = np.array([[2.0, 0, 1], [0, 3, 2], [0.5, 0, 1]])
    points = np.array([[0.0, 0.0], [2.0, 4.0]])
    np.testing.assert_allclose(apply_homography(H, points), [[1, 2], [2.5, 7]])


def test_corners_go_clockwise_from_the_top_left():
    np.testing.assert_array_equal(
        reference_corners(400, 300), [[0, 0], [400, 0], [400, 300], [0, 300]]
    )


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
        ({"threshold": float("nan")}, "finite threshold > 0"),
        ({"threshold": float("inf")}, "finite threshold > 0"),
        ({"max_stretch": 1.0}, "max_stretch > 1"),
        ({"max_stretch": float("nan")}, "max_stretch > 1"),
    ],
)
def test_impossible_settings_are_refused(wrong, message):
    with pytest.raises(InvalidInputError, match=message):
        HomographyConfig(**wrong)
