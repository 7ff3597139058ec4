"""The robot of a simulated world as `grasping.interfaces` wants it: an arm, and eyes."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import RigidTransform
from planegrasp.grasping.interfaces import Sighting
from planegrasp.live import Live, LiveConfig, Task
from planegrasp.simulation.supports import Hand

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.detector import Detector
    from planegrasp.robot.state import RobotState
    from planegrasp.simulation.hand_motion import HandMotion
    from planegrasp.simulation.raycast_camera import RaycastCamera
    from planegrasp.simulation.raycast_values import RaycastRendering
    from planegrasp.simulation.world import World

    Float64Array = NDArray[np.float64]

__all__ = ["DriverConfig", "SimulatedArm", "SimulatedEyes"]

_COLLISIONS = (
    ("robot", "support"),
    ("fingers", "support"),
    ("robot", "floor"),
    ("fingers", "floor"),
    ("robot", "robot"),
    ("robot", "fingers"),
    ("robot", "object"),
)
# The hand's arm goes back this far, this fast, once it has let go [m, m/s], and not into the robot:
# nearer than this it stops [m].
_AWAY, _AWAY_SPEED, _FROM_ROBOT = 0.35, 0.5, 0.05


@dataclass(frozen=True, slots=True)
class DriverConfig:
    """Of the simulated robot and of the person.

    Attributes:
        gripper: name of the actuator whose control is the opening [m].
        watch: how often contacts are looked at [s].
        press: share of the commanded force with which fingers press on what they hold.
        reaction: time from the grip until the support lets go [s].
        flicker: a contact lost for less than this is none that a person feels [s].
        frame_rate: of the camera [Hz].
        latency: from taking a frame to knowing what is in it [s].
    """

    gripper: str = "r_gripper"
    watch: float = 0.01
    press: float = 0.5
    reaction: float = 0.25
    flicker: float = 0.05
    frame_rate: float = 10.0
    latency: float = 0.1


class SimulatedEyes:
    """The robot's camera, and what finds and follows the object; with a rate and a latency.

    Attributes:
        frames: how many were looked at.
        found: in how many of them the object was seen.
        tracked: in how many of those it was followed from the frame before.
        last: the last rendering, and what was detected in it.
    """

    def __init__(
        self,
        world: World,
        camera: RaycastCamera,
        detector: Detector,
        rng: np.random.Generator,
        *,
        background: NDArray[np.uint8] | None = None,
        config: DriverConfig | None = None,
    ) -> None:
        """See `SimulatedEyes`; the background is what the wall shows."""
        self._world, self._camera, self._rng = world, camera, rng
        self._name = world.object_model.name
        # In the caller's thread, so that a run is the same whatever else the machine does.
        live = LiveConfig(background=False)
        # Of an object that the detector does not know nothing is ever seen.
        known = any(r.object.name == self._name for r in detector.references)
        task = Task({self._name: 1.0} if known else {}, others=False)
        self._live = Live(detector, task, live)
        self._background, self._config = background, config or DriverConfig()
        self._seen: deque[Sighting] = deque()
        self._next = 0.0
        self._wanted = False
        self.frames = self.found = self.tracked = 0
        self.last: tuple[RaycastRendering, Detection | None] | None = None

    def detect(self) -> Detection | None:
        """Take a frame now, and follow the object into it or find it there."""
        rendering = self._camera.render(
            self._world.data, self._rng, background=self._background, timestamp=self._world.time
        )
        found = self._live.process(rendering.frame, self._world.T_base_camera).detections
        detection = next((d for d in found if d.name == self._name), None)
        self.frames += 1
        self.found += detection is not None
        self.tracked += detection is not None and detection.tracked
        self.last = (rendering, detection)
        return detection

    def sight(self, detection: Detection) -> Sighting | None:
        """What a detection in a frame of this moment says, None where it has no whole pose."""
        pose = detection.pose
        if pose is None or pose.noise_covariance is None:
            return None
        T_base_object = self._world.T_base_camera * pose.T_camera_object
        return Sighting(self._world.time, T_base_object, pose.noise_covariance)

    def watch(self) -> None:
        """Take a frame if it is time for one and somebody has looked since the last one."""
        if self._world.time < self._next or not self._wanted:
            return
        self._wanted = False
        self._next = self._world.time + 1.0 / self._config.frame_rate
        detection = self.detect()
        sighting = None if detection is None or detection.ambiguous else self.sight(detection)
        if sighting is not None:
            self._seen.append(sighting)

    def look(self) -> Sighting | None:
        """The newest sighting that is known by now."""
        self._wanted = True
        newest = None
        while self._seen and self._seen[0].time + self._config.latency <= self._world.time:
            newest = self._seen.popleft()
        return newest


class SimulatedArm:
    """Drives the robot's arm, and lets the person and the camera act while time passes.

    Attributes:
        collisions: what the robot touched that it must not touch, in words, and when first [s].
        released_at: T_base_object when its support let go, None before.
        gripped_at: T_gripper_object at that time, None before.
    """

    def __init__(
        self,
        world: World,
        *,
        motion: HandMotion | None = None,
        eyes: SimulatedEyes | None = None,
        config: DriverConfig | None = None,
    ) -> None:
        """Drive a world's robot; `motion` is that of the hand that holds the object."""
        self.world = world
        self._motion, self._eyes = motion, eyes
        self._config = config or DriverConfig()
        self._force = 0.0
        self._gripped_since: float | None = None
        self._gripped_last = -np.inf
        self._released: tuple[float, RigidTransform, Float64Array] | None = None
        self._gone = 0.0
        self.collisions: dict[str, float] = {}
        self.released_at: RigidTransform | None = None
        self.gripped_at: RigidTransform | None = None

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.world.time

    @property
    def state(self) -> RobotState:
        """Where all joints are."""
        return self.world.robot_state

    @property
    def is_gripping(self) -> bool:
        """Whether both fingers press on the object with about the commanded force."""
        grip = self.world.grip()
        return grip.closed and grip.force > self._config.press * 2 * self._force

    def move(self, q: Float64Array) -> None:
        """Set the controls of the arm's actuators, which bear the names of its joints."""
        joints = self.world.robot.arm_joints
        self.world.control(dict(zip(joints, np.asarray(q).tolist(), strict=True)))

    def turn_head(self, state: RobotState) -> None:
        """Turn the head to where it is in a state, see `Robot.look_at`."""
        robot = self.world.robot
        self.world.control({name: robot.joint(state, name) for name in robot.head_joints})

    def grip(self, opening: float, force: float) -> None:
        """Set the gripper's control, and what it may press with."""
        self._force = force
        self.world.limit_force(self._config.gripper, force)
        self.world.control({self._config.gripper: opening})

    def advance(self, seconds: float) -> None:
        """Simulate; the person's hand moves, the camera looks, contacts are noticed."""
        end = self.world.time + seconds - 1e-9
        while self.world.time < end:
            self._move_hand()
            remaining = end + 1e-9 - self.world.time
            self.world.step(max(min(self._config.watch, remaining), self.world.model.opt.timestep))
            self._notice()
            if self._eyes is not None:
                self._eyes.watch()

    def _notice(self) -> None:
        world = self.world
        for first, second in _COLLISIONS:
            for contact in world.contacts(first, second, min_force=0.5):
                what = f"{contact.first} touches {contact.second}"
                self.collisions.setdefault(what, world.time)
        if world.is_released:
            return
        if self.is_gripping:
            self._gripped_last = world.time
            if self._gripped_since is None:
                self._gripped_since = world.time
        elif world.time - self._gripped_last > self._config.flicker:
            self._gripped_since = None
        if self._gripped_since is None:
            return
        if world.time - self._gripped_since >= self._config.reaction:
            world.release()
            self.released_at = world.T_base_object
            self.gripped_at = world.T_base_gripper.inv() * world.T_base_object
            self._released = (world.time, world.T_base_object, _outwards(world))

    def _move_hand(self) -> None:
        if self._motion is None:
            return
        if self._released is None:
            self.world.move_support(self._motion.pose(self.world.time))
            return
        since, T, outwards = self._released
        farther = min(_AWAY, self._gone + _AWAY_SPEED * (self.world.time - since))
        self._released = self.world.time, T, outwards
        goal = RigidTransform.from_translation(farther * outwards) * T
        if farther > self._gone and self.world.may_move_support(goal, _FROM_ROBOT):
            self._gone = farther
            self.world.move_support(goal)


def _outwards(world: World) -> Float64Array:
    """Where the person's arm is, seen from the object: unit vector in the base frame."""
    support = world.support
    if not isinstance(support, Hand):
        return np.zeros(3)
    T = world.T_base_object
    return np.asarray(T.rotation.apply([*support.direction, 0.0]), dtype=np.float64)
