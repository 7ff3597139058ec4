"""The parts of a robot, from what users say about a model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from planegrasp.errors import InvalidInputError, RobotError
from planegrasp.robot import loading
from planegrasp.robot.gripper import Gripper

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Float64Array = NDArray[np.float64]

# Soft limits lie inside of the hard ones by the margin, but never by more of the range than this.
_LARGEST_MARGIN_SHARE = 0.1
_SLIDE_MARGIN_PER_RADIAN = 0.05


def check_on_the_way(model: mujoco.MjModel, arm: list[int], on_the_way: list[int]) -> None:
    """Refuse, with a RobotError, arm joints that do not move the gripper or are out of order."""
    strangers = [model.joint(joint).name for joint in arm if joint not in on_the_way]
    if strangers:
        raise RobotError(
            f"{', '.join(strangers)} do not move the gripper; between base and gripper are "
            f"{', '.join(model.joint(joint).name for joint in on_the_way)}"
        )
    if arm != sorted(arm):
        raise RobotError("arm_joints must be in their order from the base outwards")


def limit_margins(
    model: mujoco.MjModel, arm: list[int], lower: Float64Array, upper: Float64Array, margin: float
) -> Float64Array:
    """How far soft limits of joints lie inside of hard ones, see `Robot.from_file`."""
    if not (np.isfinite(margin) and margin >= 0):
        raise InvalidInputError(f"limit_margin must be ≥ 0 rad, got {margin}")
    slides = model.jnt_type[arm] == mujoco.mjtJoint.mjJNT_SLIDE
    wanted = np.where(slides, margin * _SLIDE_MARGIN_PER_RADIAN, margin)
    return np.asarray(np.minimum(wanted, _LARGEST_MARGIN_SHARE * (upper - lower)))


def make_gripper(
    model: mujoco.MjModel,
    fingers: Sequence[str] | Mapping[str, tuple[float, float]],
    max_opening: float | None,
) -> Gripper | None:
    """The gripper that these finger joints make, None without any, see `Robot.from_file`."""
    if not fingers:
        return None
    ids = [loading.find(model, ("joint",), name, "finger joint")[1] for name in fingers]
    loading.check_single_dof(model, ids)
    if isinstance(fingers, Mapping):
        ends = np.array([fingers[name] for name in fingers], dtype=np.float64)
    else:
        ends = np.array([loading.joint_range(model, joint) for joint in ids])
    if not np.all(np.isfinite(ends)) or np.any(ends[:, 0] == ends[:, 1]):
        raise RobotError(
            f"fingers need a closed and an open position, limits or as a mapping; of "
            f"{', '.join(fingers)} they are {ends.tolist()}"
        )
    if max_opening is None:
        if np.any(model.jnt_type[ids] != mujoco.mjtJoint.mjJNT_SLIDE):
            raise RobotError("max_opening [m] must be given for fingers that do not slide")
        max_opening = float(np.abs(ends[:, 1] - ends[:, 0]).sum())
    return Gripper(
        tuple(fingers), tuple(ends[:, 0].tolist()), tuple(ends[:, 1].tolist()), max_opening
    )


def home_position(model: mujoco.MjModel, home: str | Mapping[str, float] | None) -> Float64Array:
    """Joint positions, nq, at a keyframe or by name, see `Robot.from_file`."""
    if home is None and model.nkey:
        return np.array(model.key_qpos[0])
    if isinstance(home, str):
        return np.array(model.key_qpos[loading.find(model, ("key",), home, "keyframe")[1]])
    qpos = np.array(model.qpos0)
    for joint in np.flatnonzero(model.jnt_limited).tolist():
        low, high = model.jnt_range[joint]
        if not low <= qpos[model.jnt_qposadr[joint]] <= high:
            qpos[model.jnt_qposadr[joint]] = (low + high) / 2
    for name, value in (home or {}).items():
        joint = loading.find(model, ("joint",), name, "joint")[1]
        qpos[model.jnt_qposadr[joint]] = value
    return qpos
