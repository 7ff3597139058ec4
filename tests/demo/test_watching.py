"""A watched world: who looks on sees all of it, and is called in time."""

import numpy as np
import pytest

from planegrasp.demo.grasping import ACTS
from planegrasp.demo.watching import onlooker_view, wall, watched
from planegrasp.robot import Robot
from planegrasp.simulation.experiment import KINECT
from planegrasp.simulation.objects import cracker_box, picture_book


class Only:
    """As much of an experiment as a world needs."""

    robot = Robot.pr2()


@pytest.fixture(scope="module", params=ACTS, ids=lambda act: act.name)
def world(request):
    setting = request.param.setting(Only.robot, (cracker_box(), picture_book()), 0)
    return watched(Only, setting)


def test_the_onlooker_sees_the_whole_robot(world):
    rendering = onlooker_view(world).render(world.data, np.random.default_rng(0), background=wall())
    bodies = world.model.geom_bodyid[np.maximum(rendering.geoms, 0)]
    names = [world.model.body(b).name for b in range(world.model.nbody)]
    robot = [i for i, name in enumerate(names) if name not in ("world", "object", "support")]
    seen = np.isin(bodies, robot) & (rendering.geoms >= 0)
    rows, columns = np.nonzero(seen)
    height, width = seen.shape
    # Nothing of it reaches the edge of the picture, and it fills most of its height.
    assert rows.min() > 0
    assert rows.max() < height - 1
    assert columns.min() > 0
    assert columns.max() < width - 1
    assert np.ptp(rows) > 0.7 * height
    assert np.isin(bodies, names.index("object")).sum() > 200


def test_both_cameras_see_the_mat(world):
    faces = len(world.object_model.faces)
    for camera in (onlooker_view(world), world.camera(KINECT)):
        owners = camera.render(world.data, np.random.default_rng(0)).owners
        assert (owners >= faces).mean() > 0.2


def test_it_is_watched_at_its_period(world):
    times = []
    world.watch = lambda: times.append(world.time)
    for _ in range(50):
        world.step(0.01)
    world.watch = None
    world.step(0.2)
    np.testing.assert_allclose(np.diff(times), 0.1, atol=1e-9)
    assert len(times) == 5
