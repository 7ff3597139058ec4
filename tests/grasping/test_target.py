"""A moving target against a motion that is known."""

import numpy as np
import pytest

from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.grasping.interfaces import Sighting
from planegrasp.grasping.target import MovingTarget

COVARIANCE = np.diag([0.001**2] * 3 + [0.005**2] * 3)
VELOCITY = np.array([0.05, -0.03, 0.02])


def true_pose(time):
    return RigidTransform.from_components(
        [0.6, 0.1, 0.8] + VELOCITY * time, Rotation.from_euler("z", 0.1 * time)
    )


def sighting(time, off=(0.0, 0.0, 0.0)):
    return Sighting(time, RigidTransform.from_translation(off) * true_pose(time), COVARIANCE)


class Seen:
    def __init__(self, sighting):
        self._sighting = sighting

    def look(self):
        sighting, self._sighting = self._sighting, None
        return sighting


def follow(target, times):
    return [target.update(Seen(sighting(t))) for t in times]


def distance(target, time):
    return np.linalg.norm(target.at(time).translation - true_pose(time).translation)


@pytest.fixture
def target():
    """That has been followed for two seconds."""
    target = MovingTarget(sighting(0.0))
    assert all(follow(target, np.arange(1, 21) / 10))
    return target


def test_late_sightings_say_where_the_object_is_now(target):
    assert target.seen == 2.0
    # Known 0.2 s late: without the velocity it would be 12 mm off.
    assert np.linalg.norm(true_pose(2.2).translation - true_pose(2.0).translation) > 0.012
    assert distance(target, 2.2) < 1e-3
    turned = target.at(2.2).rotation.inv() * true_pose(2.2).rotation
    assert turned.magnitude() < np.radians(0.3)


def test_it_knows_less_and_less_where_it_is(target):
    sigmas = [target.sigma(t) for t in (2.0, 2.5, 3.0, 5.0)]
    assert np.all(np.diff(sigmas) > 0)
    assert sigmas[0] < 0.002
    # A velocity that wanders by 0.1 m/s a √s: 0.1 · √(3³/3) m after three seconds.
    assert sigmas[-1] == pytest.approx(0.3, rel=0.1)


def test_outliers_are_refused(target):
    before = target.at(3.0).translation
    assert not target.update(Seen(sighting(2.1, off=(0.2, 0.0, 0.0))))
    assert target.seen == 2.0
    np.testing.assert_array_equal(target.at(3.0).translation, before)
    assert target.update(Seen(sighting(2.2)))


def test_contradictions_that_agree_are_believed(target):
    off = (0.2, 0.0, 0.1)
    assert [target.update(Seen(sighting(t, off))) for t in (2.1, 2.2)] == [False, False]
    assert target.seen == 2.0
    assert not target.update(Seen(sighting(2.3, off)))
    assert target.seen == 2.3
    jumped = true_pose(2.3).translation + off
    assert np.linalg.norm(target.at(2.3).translation - jumped) < 0.002
    assert target.update(Seen(sighting(2.4, off)))


def test_contradictions_that_contradict_each_other_are_not_believed(target):
    for i in range(9):
        off = np.array([0.3, 0.0, 0.0]) * (-1) ** i
        assert not target.update(Seen(sighting(2.1 + 0.1 * i, off)))
    assert target.seen == 2.0
    assert distance(target, 3.0) < 0.005


def test_right_sightings_between_outliers_make_it_patient(target):
    for i in range(6):
        off = (0.2, 0.0, 0.0) if i % 2 == 0 else (0.0, 0.0, 0.0)
        target.update(Seen(sighting(2.1 + 0.1 * i, off)))
    assert target.seen == pytest.approx(2.6)
    assert distance(target, 2.6) < 0.002


def test_old_news_and_no_news_are_no_news(target):
    assert not target.update(Seen(sighting(1.5)))
    assert not target.update(Seen(None))
    assert target.seen == 2.0


def test_before_it_was_seen_it_was_where_it_was_seen(target):
    # A camera's clock may be a little ahead of the arm's.
    np.testing.assert_array_equal(target.at(1.9).translation, target.at(2.0).translation)
    assert target.sigma(1.9) == target.sigma(2.0)
