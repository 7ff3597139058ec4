"""A simulated world: a robot, the floor, and an object that something holds up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.robot.state import RobotState
from planegrasp.simulation._dependencies import mujoco
from planegrasp.simulation.contacts import Contact, contacts, geom_groups
from planegrasp.simulation.raycast import named
from planegrasp.simulation.raycast_camera import RaycastCamera
from planegrasp.simulation.raycast_values import Printed
from planegrasp.simulation.supports import SUPPORT, Hand, Support, Tripod
from planegrasp.simulation.world_spec import OBJECT, WELD, WorldConfig, world_spec

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planegrasp.geometry import PinholeCamera
    from planegrasp.objects import ObjectModel
    from planegrasp.robot import Robot
    from planegrasp.simulation.raycast_values import RaycastConfig

__all__ = ["Contact", "Grip", "Hand", "Tripod", "World", "WorldConfig"]


# Distances beyond this are not told apart [m].
_FARTHEST = 10.0


@dataclass(frozen=True, slots=True)
class Grip:
    """How the fingers hold the object.

    Attributes:
        fingers: names of the finger bodies that touch it.
        force: sum of the normal forces between fingers and object [N].
        closed: whether at least two fingers touch it.
    """

    fingers: tuple[str, ...]
    force: float

    @property
    def closed(self) -> bool:
        """Whether the object is between fingers: a finger alone only pushes it."""
        return len(self.fingers) >= 2


class World:
    """A robot before an object, simulated by MuJoCo.

    The object is welded to its support until `release`. The support does not touch the object as
    far as contacts go, before and after: a hand that lets go does not resist. The robot touches
    everything.

    Attributes:
        model, data: MuJoCo's; the robot's joints come first in `data.qpos`.
        robot: its values are of the robot without the world.
        object_model: what is held.
        support: what holds it.
        groups: for each geom "robot" (all but the fingers), "fingers", "object", "support" or
            "floor".
        T_world_base: pose of the robot's base in MuJoCo's world.
        config: of the world.
    """

    def __init__(
        self,
        robot: Robot,
        object_model: ObjectModel,
        T_base_object: RigidTransform,
        support: Support | None = None,
        config: WorldConfig | None = None,
    ) -> None:
        """Build the world; the robot is at home and its actuators hold it there.

        Args:
            robot: any robot.
            object_model: the object, with photographs and `outer_body`.
            T_base_object: where it is held.
            support: a tripod where None.
            config: defaults where None.

        Raises:
            InvalidInputError: a face of the object does not lie on the surface of its body.
        """
        self.robot = robot
        self.object_model = object_model
        self.support = support or Tripod()
        self.config = config or WorldConfig()
        T_world_base = _pose_of_base(robot)
        T_world_object = T_world_base * T_base_object
        spec = world_spec(robot, object_model, T_world_object, self.support, self.config)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._object = named(self.model, "body", OBJECT)
        self._weld = named(self.model, "equality", WELD)
        self.groups = geom_groups(self.model, robot)
        self.T_world_base = T_world_base
        self._T_base_object = T_base_object
        self.reset()

    def reset(self, state: RobotState | None = None) -> None:
        """Put everything where it was at first, the robot at a state (home where None)."""
        mujoco.mj_resetData(self.model, self.data)
        qpos = (state or self.robot.home).qpos
        if len(qpos) != self.robot.model.nq:
            raise InvalidInputError(
                f"a state of this robot has {self.robot.model.nq} positions, got {len(qpos)}"
            )
        self.data.qpos[: len(qpos)] = qpos
        mujoco.mj_forward(self.model, self.data)
        # A position servo (its force falls with the length) holds what its control says.
        servo = self.model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE
        self.data.ctrl[servo] = self.data.actuator_length[servo]
        mujoco.mj_forward(self.model, self.data)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self.data.time)

    def step(self, seconds: float | None = None) -> None:
        """Simulate some time, rounded to time steps; one step where None."""
        steps = 1 if seconds is None else round(seconds / self.model.opt.timestep)
        mujoco.mj_step(self.model, self.data, steps)
        # A step leaves poses as they were at its start.
        mujoco.mj_kinematics(self.model, self.data)

    def control(self, values: Mapping[str, float]) -> None:
        """Set the controls of actuators by name; the others keep theirs."""
        for name, value in values.items():
            self.data.ctrl[named(self.model, "actuator", name)] = value

    def limit_force(self, actuator: str, force: float) -> None:
        """Let an actuator push and pull with no more than this [N or N·m]."""
        index = named(self.model, "actuator", actuator)
        self.model.actuator_forcelimited[index] = 1
        self.model.actuator_forcerange[index] = (-force, force)

    def move_support(self, T_base_hand: RigidTransform) -> None:
        """Move the hand; its frame is the object's as it was at first held.

        Raises:
            InvalidInputError: a tripod does not move.
        """
        mocap = self.model.body(SUPPORT).mocapid[0]
        if mocap < 0:
            raise InvalidInputError("only a hand moves, the object's support is a tripod")
        T = self.T_world_base * T_base_hand
        x, y, z, w = T.rotation.as_quat()
        self.data.mocap_pos[mocap], self.data.mocap_quat[mocap] = T.translation, (w, x, y, z)

    def may_move_support(self, T_base_hand: RigidTransform, room: float) -> bool:
        """Whether the hand could go there: it keeps this room to the robot [m], or comes no nearer.

        The robot without its fingers is meant. The hand stays where it is.
        """
        mocap = self.model.body(SUPPORT).mocapid[0]
        before = self.clearance("robot", "support")
        here = self.data.mocap_pos[mocap].copy(), self.data.mocap_quat[mocap].copy()
        self.move_support(T_base_hand)
        mujoco.mj_kinematics(self.model, self.data)
        after = self.clearance("robot", "support")
        self.data.mocap_pos[mocap], self.data.mocap_quat[mocap] = here
        mujoco.mj_kinematics(self.model, self.data)
        return after >= min(room, before)

    @property
    def is_released(self) -> bool:
        """Whether the support has let go."""
        return not self.data.eq_active[self._weld]

    def release(self) -> None:
        """The support lets go of the object."""
        self.data.eq_active[self._weld] = 0

    @property
    def robot_state(self) -> RobotState:
        """Where the robot's joints are."""
        return RobotState(self.data.qpos[: self.robot.model.nq])

    @property
    def T_base_object(self) -> RigidTransform:
        """Where the object is."""
        return self.T_world_base.inv() * self._pose("x", self._object)

    @property
    def T_base_gripper(self) -> RigidTransform:
        """Where the gripper frame is."""
        return self.robot.T_base_gripper(self.robot_state)

    @property
    def T_base_camera(self) -> RigidTransform:
        """Where the robot's camera is."""
        return self.robot.T_base_camera(self.robot_state)

    def camera(
        self, camera: PinholeCamera, frame: str | None = None, config: RaycastConfig | None = None
    ) -> RaycastCamera:
        """An RGB-D camera that sees the object's photographs; the robot's own where frame is None.

        Raises:
            InvalidInputError: there is no such site or body, or the robot has no camera.
        """
        frame = frame or self.robot.camera_frame
        if frame is None:
            raise InvalidInputError("the robot has no camera: name a site or body with one")
        printed = [Printed(OBJECT, face) for face in self.object_model.faces]
        return RaycastCamera(self.model, camera, frame, printed, config)

    def contacts(self, first: str, second: str, min_force: float = 0.0) -> tuple[Contact, ...]:
        """What of two groups touches now.

        Args:
            first: "robot" (all but the fingers), "fingers", "object", "support" or "floor".
            second: likewise; the same as the first for a robot that touches itself.
            min_force: leave out contacts with less normal force [N].
        """
        return contacts(self.model, self.data, self.groups, (first, second), min_force)

    def clearance(self, first: str, second: str) -> float:
        """Distance between two groups of `contacts` [m]; negative where they are in each other."""
        of = {
            group: [i for i, name in enumerate(self.groups) if name == group]
            for group in (first, second)
        }
        distances = (
            mujoco.mj_geomDistance(self.model, self.data, a, b, _FARTHEST, None)
            for a in of[first]
            for b in of[second]
        )
        return min(distances, default=_FARTHEST)

    def grip(self) -> Grip:
        """How the fingers hold the object."""
        touching = self.contacts("fingers", "object")
        bodies = self.model.geom_bodyid
        fingers = {
            self.model.body(bodies[named(self.model, "geom", c.first)]).name for c in touching
        }
        return Grip(tuple(sorted(fingers)), sum(c.force for c in touching))

    def _pose(self, prefix: str, index: int) -> RigidTransform:
        position = getattr(self.data, f"{prefix}pos")[index]
        matrix = getattr(self.data, f"{prefix}mat")[index].reshape(3, 3)
        return RigidTransform.from_components(position, Rotation.from_matrix(matrix))


def _pose_of_base(robot: Robot) -> RigidTransform:
    """T_world_base of the robot's own model, whose world is this one's."""
    T_base_world = robot.T_base("world", robot.home)
    return T_base_world.inv()
