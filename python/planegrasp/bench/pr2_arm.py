"""Every way in which a PR2's right arm can hold its gripper at a pose, in closed form.

The judge of what is reachable: independent of the numerical solver that the planner uses, and
complete. The arm has seven joints, one more than a pose: with the shoulder's pan fixed the others
follow from the pose, for the lift and the two rolls beside it meet in one point, and so do
the three joints of the wrist. The pan is swept over its range.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import RigidTransform, Rotation

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Float64Array = NDArray[np.float64]

__all__ = ["JOINTS", "ArmLimits", "forward", "solutions"]

JOINTS = (
    "r_shoulder_pan",
    "r_shoulder_lift",
    "r_upper_arm_roll",
    "r_elbow_flex",
    "r_forearm_roll",
    "r_wrist_flex",
    "r_wrist_roll",
)
# The robot's public description [m]: the shoulder's pan axis in the torso, its lift axis in front
# of that, and the lengths of upper arm, forearm and from the wrist to the tool frame.
_TORSO = np.array([-0.05, 0.0, 0.739675])
_SHOULDER = np.array([0.0, -0.188, 0.0])
_LIFT, _UPPER_ARM, _FOREARM, _TOOL = 0.1, 0.4, 0.321, 0.18


@dataclass(frozen=True, slots=True)
class ArmLimits:
    """Lower and upper limits [rad] of the seven joints; infinite for the two continuous ones."""

    lower: tuple[float, ...]
    upper: tuple[float, ...]


def forward(q: Float64Array, torso: float) -> RigidTransform:
    """T_base_tool of seven joint angles [rad] and the torso's lift [m]."""
    links = (
        (_shoulder(torso), "z"),
        (np.array([_LIFT, 0.0, 0.0]), "y"),
        (np.zeros(3), "x"),
        (np.array([_UPPER_ARM, 0.0, 0.0]), "y"),
        (np.zeros(3), "x"),
        (np.array([_FOREARM, 0.0, 0.0]), "y"),
        (np.zeros(3), "x"),
    )
    T = RigidTransform.identity()
    for (origin, axis), angle in zip(links, q, strict=True):
        T = T * RigidTransform.from_components(origin, Rotation.from_euler(axis, angle))
    return T * RigidTransform.from_translation([_TOOL, 0.0, 0.0])


def solutions(
    T_base_tool: RigidTransform, torso: float, limits: ArmLimits, *, step: float = 0.01
) -> Float64Array:
    """All solutions on a grid of the shoulder's pan.

    Args:
        T_base_tool: where the tool frame shall be.
        torso: the torso's lift [m].
        limits: of the joints.
        step: of the pan [rad].

    Returns:
        N×7 joint angles [rad] within the limits; empty where the pose is out of reach.
    """
    R = T_base_tool.rotation.as_matrix()
    wrist = T_base_tool.translation - _TOOL * R[:, 0]
    from_shoulder = wrist - _shoulder(torso)
    low, high = limits.lower[0], limits.upper[0]
    pan = np.linspace(low, high, max(2, int(np.ceil((high - low) / step)) + 1))
    cos, sin = np.cos(pan), np.sin(pan)
    # The wrist seen from the lift's axis, in the frame that the pan turns.
    x = cos * from_shoulder[0] + sin * from_shoulder[1] - _LIFT
    y = -sin * from_shoulder[0] + cos * from_shoulder[1]
    z = np.full_like(pan, from_shoulder[2])
    squared = x**2 + y**2 + z**2
    cos_elbow = (squared - _UPPER_ARM**2 - _FOREARM**2) / (2 * _UPPER_ARM * _FOREARM)
    reached = np.abs(cos_elbow) <= 1
    if not np.any(reached):
        return np.empty((0, 7))
    pan, x, y, z = pan[reached], x[reached], y[reached], z[reached]
    elbow = -np.arccos(cos_elbow[reached])
    # Behind the lift and the roll the wrist is at (along, 0, across).
    along = _UPPER_ARM + _FOREARM * np.cos(elbow)
    across = -_FOREARM * np.sin(elbow)
    with np.errstate(divide="ignore", invalid="ignore"):
        sin_roll = -y / across
    turned = np.abs(sin_roll) <= 1
    found = []
    for mirrored in (False, True):
        roll = np.arcsin(np.where(turned, sin_roll, 0.0))
        roll = np.pi - roll if mirrored else roll
        lift = np.arctan2(across * np.cos(roll), along) - np.arctan2(z, x)
        upper = Rotation.from_euler("ZYX", np.column_stack([pan, lift, roll]))
        upper = upper * Rotation.from_euler("y", elbow[:, None])
        hand = np.swapaxes(upper.as_matrix(), 1, 2) @ R
        flex = -np.arccos(np.clip(hand[:, 0, 0], -1.0, 1.0))
        forearm = np.arctan2(-hand[:, 1, 0], hand[:, 2, 0])
        wrist_roll = np.arctan2(-hand[:, 0, 1], -hand[:, 0, 2])
        q = np.column_stack([pan, lift, roll, elbow, forearm, flex, wrist_roll])
        found.append(q[turned])
    q = np.concatenate(found)
    lower, upper_limits = np.array(limits.lower), np.array(limits.upper)
    bounded = np.isfinite(lower) & np.isfinite(upper_limits)
    # An angle counts by its turn that lies above the lower limit.
    q[:, bounded] = lower[bounded] + np.mod(q[:, bounded] - lower[bounded] + 1e-12, 2 * np.pi)
    within = np.all((q <= upper_limits + 1e-9) | ~bounded, axis=1)
    return np.asarray(q[within], dtype=np.float64)


def _shoulder(torso: float) -> Float64Array:
    """Where the shoulder's pan axis is in the base [m], at a lift of the torso [m]."""
    return np.asarray(_TORSO + _SHOULDER + [0.0, 0.0, torso], dtype=np.float64)
