"""What the planner is told of a simulated world: what its camera sees, and what is always there."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.geometry import RigidTransform
from planegrasp.grasping.obstacles import ObstacleConfig, holding, obstacles_from_depth
from planegrasp.robot.scene import Obstacle, Scene
from planegrasp.simulation.supports import Hand, Tripod

if TYPE_CHECKING:
    from planegrasp.simulation.driver import SimulatedEyes
    from planegrasp.simulation.world import World

__all__ = ["floor_obstacle", "surroundings"]

# How far the floor reaches, and how thick its box is [m].
_FLOOR = (6.0, 6.0, 0.1)
# How far a person's fingers reach over an object's edge [m].
_FINGERS = 0.07


def surroundings(
    world: World,
    eyes: SimulatedEyes,
    T_base_object: RigidTransform,
    config: ObstacleConfig | None = None,
) -> tuple[Scene, tuple[str, ...]]:
    """Obstacles for an estimated pose of the object, and the names of those that hold it.

    Known are the floor and, where the object is on one, the tripod: a laboratory has measured its
    own. Of a hand nothing is known but what the eyes saw in their last frame, taken at this moment.

    Args:
        world: of which only what stands still and the robot's joints are used.
        eyes: that have seen the object.
        T_base_object: as estimated.
        config: what of the depth image counts.
    """
    body = world.object_model.outer_body
    if config is None:
        # Whether somebody holds it a robot is told, as it is told to follow.
        config = ObstacleConfig(fingers=_FINGERS if isinstance(world.support, Hand) else 0.0)
    seen: tuple[Obstacle, ...] = ()
    if eyes.last is not None:
        seen = obstacles_from_depth(
            eyes.last[0].frame,
            world.T_base_camera,
            T_base_object,
            body,
            robot=world.robot,
            state=world.robot_state,
            config=config,
        )
    floor = floor_obstacle(world)
    known: tuple[Obstacle, ...] = ()
    if isinstance(world.support, Tripod):
        top = float(floor.T_base_box.translation[2]) + _FLOOR[2] / 2
        known = world.support.obstacles(T_base_object, body, top)
    supports = holding(seen, T_base_object, body) + tuple(box.name for box in known)
    return Scene((*seen, *known, floor)), supports


def floor_obstacle(world: World) -> Obstacle:
    """A box whose top is the world's floor."""
    robot = world.robot
    T_base_world = robot.T_base("world", robot.home)
    middle = RigidTransform.from_translation([0.0, 0.0, world.config.floor_height - _FLOOR[2] / 2])
    return Obstacle("floor", _FLOOR, T_base_world * middle)
