"""Named frames of a MuJoCo model: bodies, sites and cameras."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.robot import loading

if TYPE_CHECKING:
    import mujoco
    from numpy.typing import NDArray

FRAMES = ("site", "body")
WITH_CAMERAS = (*FRAMES, "camera")

# MuJoCo's cameras look along -z with y up.
_CAMERA_FROM_OPTICAL = Rotation.from_euler("x", np.pi)


def body_of(
    model: mujoco.MjModel, frame: str, what: str = "frame", kinds: tuple[str, ...] = FRAMES
) -> int:
    """Id of the body that a frame is on, or is.

    Raises:
        RobotError: where there is no such frame; it lists those there are.
    """
    kind, index = loading.find(model, kinds, frame, what)
    if kind == "body":
        return index
    return int((model.site_bodyid if kind == "site" else model.cam_bodyid)[index])


def world_pose(
    model: mujoco.MjModel, data: mujoco.MjData, frame: str, kinds: tuple[str, ...] = FRAMES
) -> RigidTransform:
    """T_world_frame after MuJoCo's kinematics; of a camera, that of its optical frame."""
    kind, index = loading.find(model, kinds, frame, "frame")
    if kind == "body":
        return pose(data.xpos[index], data.xmat[index])
    if kind == "site":
        return pose(data.site_xpos[index], data.site_xmat[index])
    T_world_camera = pose(data.cam_xpos[index], data.cam_xmat[index])
    return T_world_camera * RigidTransform.from_rotation(_CAMERA_FROM_OPTICAL)


def pose(position: NDArray[np.float64], matrix: NDArray[np.float64]) -> RigidTransform:
    """The transform of a position (3) and a rotation matrix (9) as MuJoCo keeps them."""
    return RigidTransform.from_components(position, Rotation.from_matrix(matrix.reshape(3, 3)))
