"""A robot: an arm with a gripper on a base, perhaps with a camera on a head."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from planegrasp.errors import InvalidInputError, RobotError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.robot import loading, parts
from planegrasp.robot.looking import aim
from planegrasp.robot.state import RobotState

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from planegrasp.robot.gripper import Gripper

    Float64Array = NDArray[np.float64]

_PR2 = Path(__file__).parent / "models" / "pr2.xml"
_FRAME_KINDS = ("site", "body")
_OPTICAL_FROM_MUJOCO_CAMERA = Rotation.from_euler("x", np.pi)


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot model with the names of what planning needs. Made by `from_file` or `pr2`.

    Poses are in the base frame, T_base_*. Joint vectors `q` have the order of `arm_joints`; the
    other joints (torso, head, fingers) are in a `RobotState`. A Robot does not change.

    Attributes:
        path: the file it was read from.
        model: the compiled MuJoCo model; do not change it.
        base_frame: the body or site that poses refer to.
        gripper_frame: the body or site that grasps: x out of the palm, fingers close along y.
        camera_frame: optical frame of the camera (x right, y down, z forward), or None.
        arm_joints: names, from the base outwards.
        head_joints: joints that turn the camera and not the arm, from the base outwards.
        gripper: what an opening is in terms of finger joints, or None.
        lower, upper: the arm's hard limits, n each [rad or m], ±infinity for continuous joints.
        soft_lower, soft_upper: limits for planning, inside of those.
        velocity_limits: n [rad/s or m/s].
        home: where it starts.
    """

    path: Path
    model: mujoco.MjModel
    base_frame: str
    gripper_frame: str
    camera_frame: str | None
    arm_joints: tuple[str, ...]
    head_joints: tuple[str, ...]
    gripper: Gripper | None
    lower: Float64Array
    upper: Float64Array
    soft_lower: Float64Array
    soft_upper: Float64Array
    velocity_limits: Float64Array
    home: RobotState
    _threads: threading.local = field(default_factory=threading.local, repr=False)

    @classmethod
    def from_file(
        cls,
        path: str | Path,
        *,
        gripper_frame: str,
        base_frame: str = "world",
        arm_joints: Sequence[str] | None = None,
        exclude_joints: Sequence[str] = (),
        finger_joints: Sequence[str] | Mapping[str, tuple[float, float]] = (),
        max_opening: float | None = None,
        camera_frame: str | None = None,
        velocity_limits: Mapping[str, float] | None = None,
        limit_margin: float = 0.10,
        home: str | Mapping[str, float] | None = None,
    ) -> Robot:
        """Read a robot from MJCF or URDF.

        Args:
            path: the file.
            gripper_frame: body (URDF: link) or site that grasps: x out of the palm, fingers close
                along y.
            base_frame: body or site that poses refer to.
            arm_joints: names of the joints to plan with; by default all between base and gripper.
            exclude_joints: joints between base and gripper that are not to be moved (a torso).
            finger_joints: names; closed at their lower and open at their upper limit, or a mapping
                from name to (closed, open).
            max_opening: between the open fingers [m]; by default the sum of what sliding fingers
                move.
            camera_frame: body or site (optical frame), or MuJoCo camera, of the robot's own camera.
            velocity_limits: per joint name [rad/s or m/s]; see `loading.velocity_limits` for what
                counts where it says nothing.
            limit_margin: how far soft limits are inside of hard ones [rad], and 0.05 m per rad of
                it for sliding joints; at most a tenth of the joint's range.
            home: name of a keyframe, or joint positions by name; by default the first keyframe, or
                else zero, or the middle of the range where zero is outside of it.

        Raises:
            RobotError: for a file that cannot be read and for names that it does not have.
        """
        path = Path(path)
        model = loading.compile_spec(loading.read_spec(path), str(path))
        base_body = _body_of(model, base_frame, "base frame")
        on_the_way = loading.chain(
            model, base_body, _body_of(model, gripper_frame, "gripper frame")
        )
        if arm_joints is None:
            excluded = {
                loading.find(model, ("joint",), name, "joint")[1] for name in exclude_joints
            }
            arm = [joint for joint in on_the_way if joint not in excluded]
        else:
            arm = [loading.find(model, ("joint",), name, "arm joint")[1] for name in arm_joints]
            parts.check_on_the_way(model, arm, on_the_way)
        if not arm:
            raise RobotError(f"no joint moves {gripper_frame!r} with respect to {base_frame!r}")
        loading.check_single_dof(model, arm)
        lower, upper = np.array([loading.joint_range(model, joint) for joint in arm]).T
        margin = parts.limit_margins(model, arm, lower, upper, limit_margin)
        head: list[int] = []
        if camera_frame is not None:
            to_camera = loading.chain(model, base_body, _camera_body(model, camera_frame))
            head = [joint for joint in to_camera if joint not in on_the_way]
        return cls(
            path=path,
            model=model,
            base_frame=base_frame,
            gripper_frame=gripper_frame,
            camera_frame=camera_frame,
            arm_joints=tuple(model.joint(joint).name for joint in arm),
            head_joints=tuple(model.joint(joint).name for joint in head),
            gripper=parts.make_gripper(model, finger_joints, max_opening),
            lower=_frozen(lower),
            upper=_frozen(upper),
            soft_lower=_frozen(lower + margin),
            soft_upper=_frozen(upper - margin),
            velocity_limits=_frozen(
                loading.velocity_limits(model, arm, path, velocity_limits or {})
            ),
            home=RobotState(parts.home_position(model, home)),
        )

    @classmethod
    def pr2(cls) -> Robot:
        """The PR2's right arm, gripper and head with a Kinect v1, torso lifted by 0.2 m."""
        return cls.from_file(
            _PR2,
            base_frame="base_link",
            gripper_frame="r_gripper_tool_frame",
            exclude_joints=("torso_lift",),
            finger_joints=("r_gripper_l_finger", "r_gripper_r_finger"),
            camera_frame="kinect_optical",
            home="ready",
        )

    @property
    def n(self) -> int:
        """Number of the arm's joints."""
        return len(self.arm_joints)

    @property
    def continuous(self) -> NDArray[np.bool_]:
        """Which of the arm's joints turn without limits, n."""
        return np.asarray(~np.isfinite(self.lower))

    def spec(self) -> mujoco.MjSpec:
        """A fresh MuJoCo specification of the robot, to build scenes around."""
        return loading.read_spec(self.path)

    def arm(self, state: RobotState) -> Float64Array:
        """The arm's joint positions, n [rad or m]."""
        return self._checked(state).qpos[self._addresses(self.arm_joints)]

    def with_arm(self, state: RobotState, q: ArrayLike) -> RobotState:
        """The state with the arm at q (n)."""
        values = np.asarray(q, dtype=np.float64)
        if values.shape != (self.n,):
            raise InvalidInputError(
                f"the arm has {self.n} joints ({', '.join(self.arm_joints)}), got shape "
                f"{values.shape}"
            )
        qpos = self._checked(state).qpos.copy()
        qpos[self._addresses(self.arm_joints)] = values
        return RobotState(qpos)

    def joint(self, state: RobotState, name: str) -> float:
        """Position of one joint [rad or m]."""
        return float(self._checked(state).qpos[self._addresses((name,))[0]])

    def with_joints(self, state: RobotState, values: Mapping[str, float]) -> RobotState:
        """The state with some joints elsewhere, by name."""
        qpos = self._checked(state).qpos.copy()
        qpos[self._addresses(tuple(values))] = list(values.values())
        return RobotState(qpos)

    def with_opening(self, state: RobotState, opening: float) -> RobotState:
        """The state with the gripper open by `opening` [m]."""
        if self.gripper is None:
            raise RobotError("the robot has no gripper: name its finger_joints")
        return self.with_joints(state, self.gripper.joint_values(opening))

    def opening(self, state: RobotState) -> float:
        """The gripper's opening [m]."""
        if self.gripper is None:
            raise RobotError("the robot has no gripper: name its finger_joints")
        return self.gripper.opening({name: self.joint(state, name) for name in self.gripper.joints})

    def T_base(self, frame: str, state: RobotState) -> RigidTransform:
        """Pose of a site, body or camera (as an optical frame) in the base frame."""
        data = self._data()
        data.qpos[:] = self._checked(state).qpos
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_camlight(self.model, data)
        T_world_base = _pose(self.model, data, self.base_frame, _FRAME_KINDS)
        return T_world_base.inv() * _pose(self.model, data, frame, (*_FRAME_KINDS, "camera"))

    def T_base_gripper(self, state: RobotState) -> RigidTransform:
        """Pose of the gripper frame (forward kinematics)."""
        return self.T_base(self.gripper_frame, state)

    def T_base_camera(self, state: RobotState) -> RigidTransform:
        """Pose of the camera's optical frame.

        Raises:
            RobotError: for a robot without camera.
        """
        if self.camera_frame is None:
            raise RobotError("the robot has no camera: name its camera_frame")
        return self.T_base(self.camera_frame, state)

    def look_at(self, point: ArrayLike, state: RobotState | None = None) -> RobotState:
        """Turn the head so that a point is in the middle of the camera's image.

        Args:
            point: 3, in the base frame [m].
            state: where the other joints are and the head starts; home by default.

        Raises:
            RobotError: where the head cannot turn that far, or there is none.
        """
        start = self.home if state is None else state
        ranges = [
            loading.joint_range(self.model, self.model.joint(name).id) for name in self.head_joints
        ]
        values = aim(
            lambda head: self.T_base_camera(
                self.with_joints(start, dict(zip(self.head_joints, head, strict=True)))
            ),
            np.array(ranges).reshape(-1, 2),
            np.array([self.joint(start, name) for name in self.head_joints]),
            np.asarray(point, dtype=np.float64),
        )
        return self.with_joints(start, dict(zip(self.head_joints, values.tolist(), strict=True)))

    def _data(self) -> mujoco.MjData:
        """MuJoCo's scratch memory, which takes milliseconds to make and is not to be shared."""
        if not hasattr(self._threads, "data"):
            self._threads.data = mujoco.MjData(self.model)
        return self._threads.data

    def _addresses(self, joints: tuple[str, ...]) -> NDArray[np.int64]:
        ids = [loading.find(self.model, ("joint",), name, "joint")[1] for name in joints]
        return np.asarray(self.model.jnt_qposadr[ids], dtype=np.int64)

    def _checked(self, state: RobotState) -> RobotState:
        if len(state.qpos) != self.model.nq:
            raise InvalidInputError(
                f"a state of this robot has {self.model.nq} positions, got {len(state.qpos)}"
            )
        return state


def _frozen(values: Float64Array) -> Float64Array:
    values = np.array(values, dtype=np.float64)
    values.flags.writeable = False
    return values


def _body_of(model: mujoco.MjModel, frame: str, what: str) -> int:
    kind, index = loading.find(model, _FRAME_KINDS, frame, what)
    return index if kind == "body" else int(model.site_bodyid[index])


def _camera_body(model: mujoco.MjModel, frame: str) -> int:
    kind, index = loading.find(model, (*_FRAME_KINDS, "camera"), frame, "camera frame")
    return int(model.cam_bodyid[index]) if kind == "camera" else _body_of(model, frame, "camera")


def _pose(
    model: mujoco.MjModel, data: mujoco.MjData, frame: str, kinds: tuple[str, ...]
) -> RigidTransform:
    kind, index = loading.find(model, kinds, frame, "frame")
    prefix = {"body": "", "site": "site_", "camera": "cam_"}[kind]
    rotation = Rotation.from_matrix(getattr(data, f"{prefix}xmat")[index].reshape(3, 3))
    if kind == "camera":
        rotation = rotation * _OPTICAL_FROM_MUJOCO_CAMERA
    return RigidTransform.from_components(getattr(data, f"{prefix}xpos")[index], rotation)
