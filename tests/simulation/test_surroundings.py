"""What the planner is told of a simulated world, against where things are in it."""

import numpy as np
import pytest
from worlds import BEFORE_PR2, CAMERA

from planegrasp.detector import Detector
from planegrasp.grasping.obstacles import ObstacleConfig
from planegrasp.robot import CollisionChecker
from planegrasp.simulation.driver import SimulatedEyes
from planegrasp.simulation.supports import Hand, Tripod
from planegrasp.simulation.surroundings import floor_obstacle, surroundings
from planegrasp.simulation.world import World


def told(pr2, box, support, config=None):
    world = World(pr2, box, BEFORE_PR2, support)
    world.reset(pr2.look_at(BEFORE_PR2.translation))
    eyes = SimulatedEyes(world, world.camera(CAMERA), Detector([box]), np.random.default_rng(0))
    assert eyes.detect() is not None
    return world, *surroundings(world, eyes, world.T_base_object, config)


def geoms_near(world, obstacles, reach):
    """Share of the boxes whose middle is within a reach of the support's middles [m]."""
    middles = np.array(
        [
            world.data.geom(i).xpos
            for i in range(world.model.ngeom)
            if world.model.geom(i).name.startswith("support")
        ]
    )
    places = [
        (world.robot.T_base("world", world.robot.home).inv() * b.T_base_box).translation
        for b in obstacles
    ]
    return np.linalg.norm(middles - np.array(places)[:, None], axis=2).min(axis=1) < reach


def test_a_hand_is_seen_and_holds(pr2, box):
    world, scene, supports = told(pr2, box, Hand("left"))
    seen = [obstacle for obstacle in scene.obstacles if obstacle.name.startswith("seen")]
    assert {obstacle.name for obstacle in scene.obstacles} - {o.name for o in seen} == {"floor"}
    # All that is near the object belongs to the hand: its forearm is 0.28 m long.
    assert set(supports) == {obstacle.name for obstacle in seen}
    beyond = ObstacleConfig().beyond
    assert geoms_near(world, seen, 0.2 + beyond).all()
    in_image = told(pr2, box, Hand("left"), ObstacleConfig(beyond=0.0))[1].obstacles[:-1]
    assert geoms_near(world, in_image, 0.2).all()
    # The robot stands free, its arm in the image.
    checker = CollisionChecker(pr2, scene, state=world.robot_state)
    assert checker.check(pr2.arm(world.robot_state)) is None


def test_a_tripod_is_known(pr2, box):
    _, scene, supports = told(pr2, box, Tripod())
    names = {"tripod-plate", "tripod-neck", "tripod-pole", "tripod-leg-0", "floor"}
    assert names <= {obstacle.name for obstacle in scene.obstacles}
    assert "tripod-plate" in supports
    assert "floor" not in supports


def test_the_floor_is_where_the_world_has_it(pr2, box):
    world = World(pr2, box, BEFORE_PR2)
    floor = floor_obstacle(world)
    top = floor.T_base_box.apply([0.0, 0.0, floor.size[2] / 2])
    in_world = pr2.T_base("world", pr2.home).inv().apply(top)
    assert in_world[2] == pytest.approx(world.config.floor_height)
