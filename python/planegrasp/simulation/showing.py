"""Show the robot a grasp: object and gripper close together, seen and recorded (paper, eq. 10).

Who teaches a real robot moves its gripper to the object by hand. Here the arm is put there; what is
recorded is the same: the object as the camera sees it, the gripper as the joints say.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import TeachingError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.grasping.canonical import CanonicalGrasp
from planegrasp.robot.kinematics import Kinematics
from planegrasp.simulation.driver import SimulatedEyes
from planegrasp.simulation.experiment import KINECT, facing
from planegrasp.simulation.world import World, WorldConfig

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planegrasp.body import BoxBody
    from planegrasp.detector import Detector
    from planegrasp.robot.model import Robot
    from planegrasp.simulation.objects import Thing

__all__ = ["SIDES", "Shown", "hold_at", "show_grasp"]

SIDES = ("side", "top", "left", "bottom")
"""Where the gripper takes the object: at its right side, from above, at its left, from below."""

# How far the point between the fingertips lies inside of the object's edge [m].
_DEPTH = 0.03
# Where the object may be shown: the first place at which the arm can hold it [m].
_PLACES = ((0.62, -0.12, 0.85), (0.55, -0.20, 0.70), (0.50, -0.10, 0.95), (0.60, -0.35, 0.80))
# How high its face looks, between the horizon (0) and the camera (1).
_UPWARDS = (1.0, 0.5, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """What was recorded.

    Attributes:
        T_base_object: as the camera sees it.
        T_base_gripper: as the joints say.
        opening: of the gripper [m].
        T_base_object_true: as the simulation knows it.
    """

    T_base_object: RigidTransform
    T_base_gripper: RigidTransform
    opening: float
    T_base_object_true: RigidTransform

    def grasp(self, name: str) -> CanonicalGrasp:
        """The canonical grasp that was shown (paper, eq. 10)."""
        return CanonicalGrasp.teach(
            name, self.T_base_object, self.T_base_gripper, opening=self.opening
        )


def hold_at(body: BoxBody, side: str) -> RigidTransform:
    """T_object_gripper that takes a body at one of `SIDES`, fingers before and behind its face.

    Raises:
        TeachingError: there is no such side.
    """
    if side not in SIDES:
        raise TeachingError(f"a gripper takes an object at {', '.join(SIDES)}, not {side!r}")
    outwards = {"side": (1, 0, 0), "top": (0, 1, 0), "left": (-1, 0, 0), "bottom": (0, -1, 0)}
    out = np.array(outwards[side], dtype=np.float64)
    x, y = -out, np.array([0.0, 0.0, 1.0])
    edge = float(np.abs(out) @ np.array(body.size)) / 2
    position = np.asarray(body.centre) + out * (edge - _DEPTH)
    R = Rotation.from_matrix(np.column_stack([x, y, np.cross(x, y)]))
    return RigidTransform.from_components(position, R)


def show_grasp(
    robot: Robot,
    thing: Thing,
    detector: Detector,
    side: str = "side",
    *,
    opening: float | None = None,
    seed: int = 0,
) -> Shown:
    """Put object and gripper together before the camera and record both.

    Args:
        robot: with camera and gripper.
        thing: that the detector knows.
        detector: that finds it in the rendered frame.
        side: of `SIDES`.
        opening: of the gripper [m]; nearly its largest where None.
        seed: of the sensors' noise, and of the search for the arm's posture.

    Raises:
        TeachingError: the object does not fit between the fingers, the arm does not reach it there,
            or the camera does not see it.
    """
    if robot.gripper is None:
        raise TeachingError("a robot without gripper cannot show a grasp")
    opening = 0.95 * robot.gripper.max_opening if opening is None else opening
    body = thing.model.outer_body
    if body.size[2] >= opening:
        raise TeachingError(
            f"{thing.model.name!r} is {1000 * body.size[2]:.0f} mm deep, it does not fit between "
            f"fingers that are {1000 * opening:.0f} mm apart"
        )
    T_object_gripper = hold_at(body, side)
    for T_base_object in _places(robot):
        state = robot.look_at(T_base_object.translation)
        result = Kinematics(robot, state).inverse(T_base_object * T_object_gripper, seed=seed)
        if result:
            break
    else:
        raise TeachingError(f"the arm cannot show {side!r}: {result.reason}")
    world = World(robot, thing.model, T_base_object, config=WorldConfig(mass=thing.mass))
    world.reset(robot.with_opening(robot.with_arm(state, result.q), opening))
    eyes = SimulatedEyes(world, world.camera(KINECT), detector, np.random.default_rng(seed))
    detection = eyes.detect()
    if detection is None or detection.T_camera_object is None:
        raise TeachingError(f"the camera does not see {thing.model.name!r} behind the gripper")
    return Shown(
        world.T_base_camera * detection.T_camera_object,
        world.T_base_gripper,
        opening,
        world.T_base_object,
    )


def _places(robot: Robot) -> Iterator[RigidTransform]:
    """T_base_object of an upright object before the robot."""
    eye = robot.T_base_camera(robot.home).translation
    for upwards, place in product(_UPWARDS, _PLACES):
        position = np.array(place)
        height = position[2] + upwards * (eye[2] - position[2])
        yield facing(position, np.array([eye[0], eye[1], height]))
