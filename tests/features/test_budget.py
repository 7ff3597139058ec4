import numpy as np
import pytest

from planegrasp.features import Features
from planegrasp.features.budget import spread

SIZE = (640, 480)


def features(points, responses):
    points = np.asarray(points, np.float32)
    n = len(points)
    one = np.ones(n, np.float32)
    number = np.arange(n, dtype=np.float32)
    return Features(points, one, one, np.asarray(responses, np.float32), number[:, None])


def crowded():
    """1000 strong features in one corner of the image, 30 weak ones elsewhere."""
    rng = np.random.default_rng(0)
    strong = rng.uniform((0, 0), (160, 120), (1000, 2))
    weak = rng.uniform((400, 300), (600, 450), (30, 2))
    return features(np.vstack([strong, weak]), np.r_[rng.uniform(5, 9, 1000), [1.0] * 30])


def test_a_budget_that_is_not_reached_keeps_all():
    all_of_them = crowded()
    assert spread(all_of_them, 1030, SIZE) is all_of_them
    assert spread(all_of_them, 0, SIZE) is all_of_them


@pytest.mark.parametrize("budget", [1, 100, 500, 1029])
def test_the_budget_is_used_up_and_kept(budget):
    assert len(spread(crowded(), budget, SIZE)) == budget


def test_a_strong_crowd_does_not_take_the_places_of_weak_features_elsewhere():
    kept = spread(crowded(), 200, SIZE)
    assert np.count_nonzero(kept.responses == 1.0) == 30
    assert np.count_nonzero(kept.responses > 1.0) == 170


@pytest.mark.parametrize("place", [(10, 450), (600, 10)])
def test_cells_are_told_apart_along_both_axes(place):
    # A crowd in the first cell; the weakest feature of all straight below or beside it.
    points = [(x, y) for x in range(1, 39, 2) for y in range(1, 39, 2)]
    kept = spread(features([*points, place], [9.0] * len(points) + [1.0]), 5, SIZE)
    assert np.count_nonzero(kept.responses == 1.0) == 1


def test_within_a_cell_the_strongest_stay():
    rng = np.random.default_rng(1)
    cell = features(rng.uniform(1, 39, (50, 2)), rng.permutation(50))
    assert sorted(spread(cell, 10, SIZE).responses) == list(range(40, 50))


def test_where_one_more_a_cell_is_too_many_the_strongest_cells_get_it():
    points = [(20 + 40 * i, 20) for i in range(5) for _ in range(2)]
    responses = [10, 1, 11, 5, 12, 2, 13, 6, 14, 3]
    kept = spread(features(points, responses), 7, SIZE)
    assert sorted(kept.responses) == [5, 6, 10, 11, 12, 13, 14]


def test_the_order_of_the_features_stays():
    kept = spread(crowded(), 300, SIZE)
    assert np.all(np.diff(kept.descriptors[:, 0]) > 0)


def test_points_half_a_pixel_outside_are_not_lost_or_misplaced():
    edge = features([(-0.5, -0.5), (639.5, 479.5), (300, 200), (301, 200)], [1, 1, 9, 8])
    assert sorted(spread(edge, 3, SIZE).descriptors[:, 0]) == [0, 1, 2]
