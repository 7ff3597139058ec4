"""The paper's experiments: an object on a tripod, and one that a person holds."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from planegrasp.detector import Detector
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.grasping.executor import ExecutorConfig, GraspExecutor
from planegrasp.grasping.planner import GraspPlanner, PlannerConfig
from planegrasp.robot.motion import MotionConfig
from planegrasp.simulation.driver import SimulatedArm, SimulatedEyes
from planegrasp.simulation.hand_motion import HandMotion
from planegrasp.simulation.supports import Hand, Tripod
from planegrasp.simulation.surroundings import surroundings
from planegrasp.simulation.trial import Trial, TrialConfig, run_trial
from planegrasp.simulation.world import World, WorldConfig

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from planegrasp.detector import DetectorConfig
    from planegrasp.robot.model import Robot
    from planegrasp.simulation.objects import Thing
    from planegrasp.simulation.supports import Hold

__all__ = ["KINECT", "Experiment", "Region", "Setting", "facing", "random_pose"]

KINECT = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
"""The Kinect v1's colour camera, to which its depth is aligned."""

# A person keeps hand and arm so far from the robot, and moves by little less [m].
_KEPT_AWAY = 0.10

Kind = Literal["static", "handheld"]


@dataclass(frozen=True, slots=True)
class Region:
    """Where objects are put: positions, and how they are turned against the line of sight.

    Attributes:
        low: of the positions, in the base [m].
        high: likewise.
        tilt: largest angle between the face's normal and the line of sight [rad].
        roll: largest rotation about the face's normal, either way [rad].
    """

    low: tuple[float, float, float] = (0.45, -0.55, 0.60)
    high: tuple[float, float, float] = (0.85, 0.25, 1.20)
    tilt: float = math.radians(60.0)
    roll: float = math.radians(45.0)


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """One experiment to be done.

    Attributes:
        kind: on a tripod, or held by a person.
        thing: the object.
        T_base_object: where it is, at first.
        tilt: angle between its face's normal and the line of sight to it [rad].
        hold: where the person's hand holds it; None on a tripod.
        seed: of all that is random in it.
    """

    kind: Kind
    thing: Thing
    T_base_object: RigidTransform
    tilt: float
    hold: Hold | None
    seed: int


@dataclass(slots=True, eq=False)
class Experiment:
    """A robot, and the objects that it was taught with their grasps.

    Attributes:
        robot: any robot with a camera.
        things: with grasps.
        region: where objects are put.
        holds: where a person may hold them.
        backgrounds: photographs for the wall.
        detector_config: defaults where None.
    """

    robot: Robot
    things: Sequence[Thing]
    region: Region = field(default_factory=Region)
    holds: Sequence[Hold] = ("left", "bottom", "bottom-left", "top-left", "top")
    backgrounds: Sequence[NDArray[np.uint8]] = ()
    detector_config: DetectorConfig | None = None
    detector: Detector = field(init=False)
    planner: GraspPlanner = field(init=False)
    executor: GraspExecutor = field(init=False)

    def __post_init__(self) -> None:
        self.detector = Detector([thing.model for thing in self.things], self.detector_config)
        # What is measured must not depend on how busy the machine is.
        motion = MotionConfig(time_limit=60.0)
        self.planner = GraspPlanner(self.robot, PlannerConfig(motion=motion))
        self.executor = GraspExecutor(self.robot, ExecutorConfig(paths=motion))

    def setting(self, kind: Kind, seed: int) -> Setting:
        """Draw a setting: the same for the same kind and seed.

        Nobody puts a tripod into a robot, or an arm around it, or hangs an object face down from a
        tripod, through whose plate it could not be lifted: such a setting is drawn anew.
        """
        rng = np.random.default_rng([seed, kind == "handheld"])
        camera = self.robot.T_base_camera(self.robot.home).translation
        while True:
            thing = self.things[int(rng.integers(len(self.things)))]
            T, tilt = random_pose(rng, self.region, camera)
            hold = self.holds[int(rng.integers(len(self.holds)))] if kind == "handheld" else None
            setting = Setting(kind, thing, T, tilt, hold, seed)
            if kind == "static" and T.rotation.as_matrix()[2, 2] < 0:
                continue
            room = self.world(setting).clearance("robot", "support")
            if room > (_KEPT_AWAY if kind == "handheld" else 0.0):
                return setting

    def world(self, setting: Setting) -> World:
        """The world of a setting, before anything moves."""
        support = Tripod() if setting.hold is None else Hand(setting.hold)
        config = WorldConfig(mass=setting.thing.mass)
        return World(self.robot, setting.thing.model, setting.T_base_object, support, config)

    def run(
        self,
        setting: Setting,
        world: World | None = None,
        *,
        show: Callable[[str, SimulatedArm, SimulatedEyes], None] | None = None,
        config: TrialConfig | None = None,
    ) -> Trial:
        """Do the experiment, in the setting's world or in one made like it.

        Args:
            setting: what to do.
            world: of the setting; made where None.
            show: called at each stage with its name and what the robot moves and sees with.
            config: what counts as success.
        """
        world = self.world(setting) if world is None else world
        rng = np.random.default_rng([setting.seed, 7])
        wall = self.backgrounds[setting.seed % len(self.backgrounds)] if self.backgrounds else None
        moving = setting.kind == "handheld"
        motion = HandMotion(setting.T_base_object, rng) if moving else None
        eyes = SimulatedEyes(world, world.camera(KINECT), self.detector, rng, background=wall)
        arm = SimulatedArm(world, motion=motion, eyes=eyes)
        return run_trial(
            arm,
            eyes,
            self.planner,
            self.executor,
            lambda T_base_object: surroundings(world, eyes, T_base_object),
            moving=moving,
            config=config,
            show=None if show is None else lambda stage: show(stage, arm, eyes),
        )


def random_pose(
    rng: np.random.Generator, region: Region, eye: NDArray[np.float64]
) -> tuple[RigidTransform, float]:
    """T_base_object in a region, and the tilt of its face against the line of sight [rad].

    Args:
        rng: draws it.
        region: where.
        eye: 3, position of the camera in the base [m].
    """
    position = rng.uniform(region.low, region.high)
    tilt = float(rng.uniform(0.0, region.tilt))
    axis = float(rng.uniform(0.0, 2 * np.pi))
    roll = float(rng.uniform(-region.roll, region.roll))
    return facing(position, eye, tilt=tilt, axis=axis, roll=roll), tilt


def facing(
    position: NDArray[np.float64],
    eye: NDArray[np.float64],
    *,
    tilt: float = 0.0,
    axis: float = 0.0,
    roll: float = 0.0,
) -> RigidTransform:
    """T_base_object of something upright that faces an eye, then tilted and turned.

    Args:
        position: 3, in the base [m].
        eye: 3, what its face is turned to [m].
        tilt: angle between the face's normal and the line of sight [rad].
        axis: direction of the axis of the tilt in the upright face [rad].
        roll: about the face's normal, counter-clockwise as seen by the eye [rad].
    """
    z = (eye - position) / np.linalg.norm(eye - position)
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    upright = Rotation.from_matrix(np.column_stack([x, np.cross(z, x), z]))
    tilted = upright * Rotation.from_rotvec(tilt * np.array([np.cos(axis), np.sin(axis), 0.0]))
    return RigidTransform.from_components(position, tilted * Rotation.from_euler("z", roll))
