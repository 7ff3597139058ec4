"""Settings of experiments: where objects are, how they are turned, that they can be repeated."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planegrasp.simulation.experiment import Region, facing, random_pose
from planegrasp.simulation.supports import Hand, Tripod

EYE = np.array([0.1, 0.0, 1.5])


@given(
    tilt=st.floats(0.0, 1.5),
    axis=st.floats(0.0, 6.2),
    roll=st.floats(-0.8, 0.8),
    x=st.floats(0.4, 1.0),
    z=st.floats(0.4, 1.3),
)
def test_the_face_is_turned_from_the_line_of_sight_by_its_tilt(tilt, axis, roll, x, z):
    position = np.array([x, -0.1, z])
    T = facing(position, EYE, tilt=tilt, axis=axis, roll=roll)
    np.testing.assert_array_equal(T.translation, position)
    sight = (EYE - position) / np.linalg.norm(EYE - position)
    normal = T.rotation.apply([0.0, 0.0, 1.0])
    # An angle near 0 by its chord: a cosine knows it to 1e-8 only.
    assert 2 * math.asin(np.linalg.norm(normal - sight) / 2) == pytest.approx(tilt, abs=1e-9)


def test_what_is_not_tilted_stands_upright_and_rolls_counter_clockwise():
    position = np.array([0.7, -0.1, 0.9])
    T = facing(position, EYE)
    x, y = T.rotation.apply([1.0, 0.0, 0.0]), T.rotation.apply([0.0, 1.0, 0.0])
    assert x[2] == pytest.approx(0.0, abs=1e-12)
    assert y[2] > 0.5
    # Seen by the eye, x is to the right: the robot looks along its x, right is its -y.
    assert x[1] < -0.9
    rolled = facing(position, EYE, roll=0.3).rotation.apply([1.0, 0.0, 0.0])
    assert rolled @ y == pytest.approx(math.sin(0.3))


def test_random_poses_are_in_their_region():
    region, rng = Region(), np.random.default_rng(0)
    poses = [random_pose(rng, region, EYE) for _ in range(300)]
    positions = np.array([T.translation for T, _ in poses])
    assert np.all(positions >= region.low)
    assert np.all(positions <= region.high)
    # All of it: the outermost of 300 are within a tenth of the edges.
    size = np.subtract(region.high, region.low)
    assert np.all(np.ptp(positions, axis=0) > 0.9 * size)
    tilts = np.array([tilt for _, tilt in poses])
    assert tilts.min() < 0.1 * region.tilt
    assert 0.9 * region.tilt < tilts.max() <= region.tilt
    for T, tilt in poses[:20]:
        sight = (EYE - T.translation) / np.linalg.norm(EYE - T.translation)
        assert T.rotation.apply([0, 0, 1]) @ sight == pytest.approx(math.cos(tilt))


def test_a_setting_is_drawn_by_kind_and_seed(experiment):
    one, same = (experiment.setting("static", 4) for _ in range(2))
    np.testing.assert_array_equal(one.T_base_object.as_matrix(), same.T_base_object.as_matrix())
    assert (one.thing, one.tilt, one.hold, one.kind) == (same.thing, same.tilt, None, "static")
    others = [experiment.setting("static", 5), experiment.setting("handheld", 4)]
    for other in others:
        assert not np.allclose(one.T_base_object.translation, other.T_base_object.translation)
    assert others[1].hold in experiment.holds
    holds = {experiment.setting("handheld", seed).hold for seed in range(40)}
    assert holds == set(experiment.holds)


def test_the_world_is_that_of_the_setting(experiment):
    for kind, support in (("static", Tripod), ("handheld", Hand)):
        setting = experiment.setting(kind, 1)
        world = experiment.world(setting)
        np.testing.assert_allclose(
            world.T_base_object.as_matrix(), setting.T_base_object.as_matrix(), atol=1e-9
        )
        assert isinstance(world.support, support)
        assert world.model.body("object").mass[0] == pytest.approx(setting.thing.mass)
    assert world.support.hold == setting.hold
