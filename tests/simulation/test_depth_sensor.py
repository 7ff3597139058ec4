import numpy as np
import pytest

from planegrasp.simulation import KinectV1

SENSOR = KinectV1()
FB = SENSOR.focal_length * SENSOR.baseline


def flat(z, shape=(200, 200)):
    return np.full(shape, float(z))


def measure(depth, sensor=SENSOR, seed=0):
    return sensor.measure(depth, np.random.default_rng(seed))


@pytest.mark.parametrize("z", [0.5, 0.7, 1.5, 3.0])
def test_depth_comes_in_steps_of_an_eighth_of_a_pixel_of_disparity(z):
    eighths = FB / measure(flat(z)).astype(float) * 8
    np.testing.assert_allclose(eighths, np.rint(eighths), atol=2e-3)  # float32
    assert len(np.unique(np.rint(eighths))) > 2


@pytest.mark.parametrize("z", [0.5, 0.7, 1.5, 3.0])
def test_disparity_noise_has_the_stated_standard_deviation_and_no_bias(z):
    errors = FB / measure(flat(z)).astype(float) - FB / z
    expected = np.hypot(0.1, 0.125 / np.sqrt(12))
    n = errors.size
    # Noise of 0.8 steps before rounding: the rounding error is nearly uniform and independent.
    assert errors.std() == pytest.approx(expected, rel=0.03)
    assert abs(errors.mean()) < 5 * expected / np.sqrt(n) + 0.001


def test_depth_noise_grows_with_the_square_of_the_distance():
    near, far = (measure(flat(z)).astype(float).std() for z in (0.6, 1.8))
    assert far / near == pytest.approx(9.0, rel=0.05)
    # Khoshelham & Elberink, Sensors 2012: 1.425e-3·z² on a real device, of the same order.
    assert 1.425e-3 / 4 < near / 0.6**2 < 2 * 1.425e-3


def test_a_sensor_without_noise_only_rounds():
    exact = KinectV1(disparity_noise=0.0, disparity_step=1e-6)
    np.testing.assert_allclose(measure(flat(0.7), exact), 0.7, rtol=1e-6)


@pytest.mark.parametrize("z", [0.0, 0.35, 4.5])
def test_beyond_its_range_it_measures_nothing(z):
    assert not np.any(measure(flat(z)))


def test_inside_of_its_range_away_from_edges_it_measures_everywhere():
    assert np.all(measure(flat(2.0)) > 0)


def step(near=0.7, far=1.5):
    depth = flat(far)
    depth[:, 100:] = near
    return depth


def test_measurements_fail_at_depth_edges_and_only_near_them():
    missing = measure(step()) == 0
    columns = np.flatnonzero(missing.any(axis=0))
    assert columns.min() >= 97
    assert columns.max() <= 102
    band = missing[:, columns.min() : columns.max() + 1]
    n = band.size
    assert band.mean() == pytest.approx(0.7, abs=5 * np.sqrt(0.21 / n))


def test_some_measurements_at_an_edge_are_of_the_other_side():
    measured = measure(step(), KinectV1(edge_dropout=0.0))
    swapped_near = (measured[:, 99] < 1.0).mean()  # the far side beside the edge
    assert 0.2 < swapped_near < 0.5  # one of three neighbouring columns
    assert np.all(measured[:, :97] > 1.0)
    assert np.all(measured[:, 103:] < 1.0)


def test_edges_between_rows_are_edges_too():
    missing = measure(step().T) == 0
    assert missing.any()
    assert np.flatnonzero(missing.any(axis=1)).min() >= 97


def test_an_oblique_plane_has_no_edges():
    # 70° off: neighbouring pixels differ by centimetres, but inverse depth is linear.
    x = (np.arange(200) - 99.5) / 525.0
    depth = np.broadcast_to(1.0 / (1.0 - x * np.tan(np.radians(70))), (200, 200)).copy()
    inside = (depth > 0.5) & (depth < 3.5)
    assert np.all(measure(depth)[inside] > 0)


def test_a_step_smaller_than_the_jump_is_measured_through():
    depth = step(near=0.7, far=0.705)
    assert np.all(measure(depth) > 0)


def test_the_band_is_as_wide_as_stated():
    widths = [
        np.count_nonzero((measure(step(), KinectV1(edge_width=w, edge_dropout=1.0)) == 0)[0])
        for w in (1, 3, 5)
    ]
    assert np.diff(widths).tolist() == [2, 2]


def test_nothing_hit_beside_something_does_not_become_a_measurement_far_away():
    depth = flat(0.0)
    depth[50:150, 50:150] = 0.7
    measured = measure(depth)
    seen = measured[measured > 0]
    np.testing.assert_allclose(seen, 0.7, atol=0.03)
    assert not np.any(measured[:47])


def test_the_same_seed_gives_the_same_depth():
    np.testing.assert_array_equal(measure(step(), seed=5), measure(step(), seed=5))
    assert np.any(measure(step(), seed=5) != measure(step(), seed=6))
