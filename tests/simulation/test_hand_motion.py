from itertools import pairwise

import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation, rotation_angle
from planegrasp.simulation.hand_motion import HandMotion, HandMotionConfig

REST = RigidTransform.from_components([0.7, -0.2, 0.9], Rotation.from_euler("xyz", [0.4, 1.0, -2]))
STEP = 0.02
TIMES = np.arange(0.0, 40.0, STEP)
SEEDS = range(3)


def motion(seed=0, **settings):
    return HandMotion(REST, np.random.default_rng(seed), HandMotionConfig(**settings))


def track(pose, times=TIMES):
    return np.array([pose(t).translation for t in times])


def drift_speeds(moving):
    return np.linalg.norm(np.diff(track(moving.drift), axis=0), axis=1) / STEP


def test_it_starts_where_it_rests_and_at_rest():
    moving = motion()
    np.testing.assert_allclose(moving.pose(0.0).as_matrix(), REST.as_matrix(), atol=1e-12)
    moved = moving.pose(1e-3).translation - REST.translation
    assert np.linalg.norm(moved) < 1e-6  # at 0.1 m/s it would be 1e-4


@pytest.mark.parametrize("seed", SEEDS)
def test_the_drift_keeps_its_speed_and_stays_near(seed):
    moving = motion(seed)
    speeds = drift_speeds(moving)
    away = np.linalg.norm(track(moving.drift) - REST.translation, axis=1)
    assert speeds.max() <= 0.1 + 1e-9
    assert away.max() <= 0.08 + 1e-9
    # It does move: a bound that is never approached would make experiments easy.
    assert speeds.max() > 0.055
    assert away.max() > 0.04


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("speed", "excursion"), [(0.02, 0.08), (0.1, 0.01)])
def test_the_tighter_bound_counts(seed, speed, excursion):
    moving = motion(seed, speed=speed, excursion=excursion)
    assert drift_speeds(moving).max() <= speed + 1e-9
    away = np.linalg.norm(track(moving.drift) - REST.translation, axis=1)
    assert away.max() <= excursion + 1e-9


@pytest.mark.parametrize("seed", SEEDS)
def test_it_turns_slowly_by_a_few_degrees(seed):
    moving = motion(seed)
    turns = [moving.drift(t).rotation for t in TIMES[::10]]
    angles = np.degrees([rotation_angle(REST.rotation, turn) for turn in turns])
    rates = [np.degrees(rotation_angle(a, b)) / (10 * STEP) for a, b in pairwise(turns)]
    assert 1.0 < angles.max() <= 5.0 + 1e-6
    assert max(rates) < 15.0


@pytest.mark.parametrize("seed", SEEDS)
def test_the_tremor_is_one_of_8_to_12_hz_and_of_a_millimetre(seed):
    moving = motion(seed)
    step = 0.01
    times = np.arange(1.0, 11.0, step)  # after its onset
    tremor = track(moving.pose, times) - track(moving.drift, times)
    power = np.sum(
        np.abs(np.fft.rfft(tremor * np.hanning(len(times))[:, None], axis=0)) ** 2, axis=1
    )
    hertz = np.fft.rfftfreq(len(times), step)
    inside = (hertz > 7.6) & (hertz < 12.4)
    assert power[inside].sum() > 0.999 * power.sum()
    sizes = np.linalg.norm(tremor, axis=1)
    assert 0.4e-3 < sizes.max() <= 1e-3
    assert np.linalg.norm(moving.pose(1e-4).translation - REST.translation) < 1e-6


@pytest.mark.parametrize("seed", SEEDS)
def test_the_wander_has_only_slow_waves(seed):
    times = np.arange(0.0, 100.0, 0.1)
    path = track(motion(seed).drift, times)
    path = (path - path.mean(axis=0)) * np.hanning(len(times))[:, None]
    power = np.sum(np.abs(np.fft.rfft(path, axis=0)) ** 2, axis=1)
    hertz = np.fft.rfftfreq(len(times), 0.1)
    assert power[hertz < 0.63].sum() > 0.999 * power.sum()


def test_the_seed_decides():
    np.testing.assert_array_equal(motion(3).pose(7.7).as_matrix(), motion(3).pose(7.7).as_matrix())
    assert np.any(motion(3).pose(7.7).as_matrix() != motion(4).pose(7.7).as_matrix())


def test_without_motion_it_rests():
    still = motion(speed=0.0, turn=0.0, tremor=0.0)
    np.testing.assert_allclose(still.pose(3.0).as_matrix(), REST.as_matrix(), atol=1e-12)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"speed": -0.1}, "speed of a hand must be ≥ 0 and finite, got -0.1"),
        ({"tremor": np.inf}, "tremor of a hand"),
        ({"tremor_band": (12.0, 8.0)}, r"tremor_band must be 0 < low < high Hz, got 12.0 … 8.0"),
        ({"wander_band": (0.0, 0.3)}, "wander_band must be"),
    ],
)
def test_impossible_motions_are_refused(settings, message):
    with pytest.raises(InvalidInputError, match=message):
        HandMotionConfig(**settings)
