"""The estimators that are compared are called rightly: each finds a homography it must find."""

import numpy as np
import pytest

from planegrasp.bench.robust import ESTIMATORS, REFINED, installed
from planegrasp.homography import apply_homography

H = np.array([[0.7, -0.2, 120.0], [0.15, 0.6, 80.0], [2e-4, -1e-4, 1.0]])
CORNERS = np.array([[0.0, 0.0], [400.0, 0.0], [400.0, 300.0], [0.0, 300.0]])


def matches(wrong, seed=0):
    """200 matches, the best first, of which the last ones are wrong."""
    rng = np.random.default_rng(seed)
    source = rng.uniform((0, 0), (400, 300), (200, 2))
    target = apply_homography(H, source) + rng.normal(0, 0.3, (200, 2))
    target[200 - wrong :] = rng.uniform((0, 0), (640, 480), (wrong, 2))
    return source, target


def error(matrix):
    distances = apply_homography(matrix, CORNERS) - apply_homography(H, CORNERS)
    return float(np.linalg.norm(distances, axis=1).mean())


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_third_of_wrong_matches_does_no_harm(name):
    if not installed(name):
        pytest.skip(f"{name} is not installed")
    matrix = ESTIMATORS[name](*matches(wrong=66))
    assert matrix is not None
    assert matrix.shape == (3, 3)
    # kornia-rs does not refine: its estimate is that of the best four matches.
    assert error(matrix) < (4.0 if name == "kornia-rs" else 0.5)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_where_nothing_fits_there_is_no_exception(name):
    if not installed(name):
        pytest.skip(f"{name} is not installed")
    source = np.tile([[10.0, 20.0]], (12, 1))
    target = np.random.default_rng(0).uniform(0, 400, (12, 2))
    matrix = ESTIMATORS[name](source, target)
    assert matrix is None or matrix.shape == (3, 3)


def test_libraries_that_are_not_installed_are_left_out(monkeypatch):
    monkeypatch.setattr("planegrasp.bench.robust.find_spec", lambda name: None)
    left = [name for name in (*ESTIMATORS, *REFINED) if installed(name)]
    assert "PoseLib progressive" not in left
    assert "PoseLib + refine" not in left
    assert "kornia-rs" not in left
    assert {"OpenCV RANSAC", "planegrasp", "planegrasp + refine"} <= set(left)
