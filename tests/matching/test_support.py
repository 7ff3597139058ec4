import numpy as np
import pytest

from planegrasp.matching.index import Matches
from planegrasp.matching.support import supported

# A face turned by 30° and seen 1.5 times larger, compressed along the image's x.
TURN = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
TRUE = np.diag([0.5, 1.0]) @ (1.5 * TURN)


def matches(good=10, bad=40, seed=0, local=None, wrong_local=None):
    """True matches of an affine view first, then wrong ones."""
    rng = np.random.default_rng(seed)
    n = good + bad
    reference = rng.uniform(0, 300, (n, 2))
    image = reference @ TRUE.T + (50, 40)
    image[good:] = rng.uniform(0, 600, (bad, 2))
    affine = np.broadcast_to(TRUE if local is None else local, (n, 2, 2)).copy()
    if wrong_local is None:
        angle, scale = rng.uniform(0, 2 * np.pi, bad), rng.uniform(0.3, 2, bad)
        c, s = scale * np.cos(angle), scale * np.sin(angle)
        affine[good:] = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    return Matches(np.arange(n), reference, image, affine, rng.uniform(0.5, 0.9, n))


def test_right_matches_support_each_other_and_wrong_ones_fall_away():
    kept, support = supported(matches())
    right = kept.query < 10
    assert np.count_nonzero(right) == 10
    assert np.count_nonzero(~right) <= 2
    assert support[right].min() >= 9
    assert support[~right].max(initial=0) < 9


def test_only_wrong_matches_leave_little():
    counts = [len(supported(matches(0, 60, seed))[0]) for seed in range(10)]
    assert np.mean(counts) < 6


@pytest.mark.parametrize("off", [np.diag([1.3, 1.0]), np.diag([0.8, 1.2])])
def test_local_maps_need_not_be_exact(off):
    local = TRUE @ off
    kept, _ = supported(matches(local=local, bad=0))
    assert len(kept) == 10


def test_matches_that_are_turned_against_each_other_do_not_support_each_other():
    # Positions agree, but every keypoint says another orientation.
    some = matches(bad=0)
    affine = np.array([TURN] * 10)
    for i in range(10):
        angle = 2 * np.pi * i / 10
        c, s = np.cos(angle), np.sin(angle)
        affine[i] = TRUE @ np.array([[c, -s], [s, c]])
    turned = Matches(some.query, some.reference_points, some.image_points, affine, some.ratio)
    assert len(supported(turned)[0]) == 0


def test_one_reference_point_seen_many_times_supports_nothing():
    some = matches(bad=0)
    one = np.broadcast_to(some.reference_points[:1], (10, 2))
    image = np.broadcast_to(some.image_points[:1], (10, 2))
    same = Matches(some.query, one, image, some.affine, some.ratio)
    assert len(supported(same)[0]) == 0


def test_of_very_many_matches_the_best_by_ratio_are_asked():
    many = matches(good=40, bad=1000)
    ratio = np.r_[np.full(40, 0.3), np.full(1000, 0.8)]
    kept, support = supported(
        Matches(many.query, many.reference_points, many.image_points, many.affine, ratio)
    )
    assert np.count_nonzero(kept.query < 40) == 40
    assert len(support) == len(kept) <= 250


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_to_support_each_other(count):
    kept, support = supported(matches(good=count, bad=0))
    assert len(kept) == len(support) == 0
