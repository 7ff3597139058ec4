"""Reading MJCF and URDF, and finding things in them by name."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree import ElementTree

import mujoco
import numpy as np

from planegrasp.errors import RobotError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

VELOCITY_PREFIX = "velocity_limit:"
# What an arm of a few kilograms can do without harm; used where the file says nothing.
DEFAULT_VELOCITY = {"hinge": 1.0, "slide": 0.1}

_OBJECTS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "joint": mujoco.mjtObj.mjOBJ_JOINT,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "camera": mujoco.mjtObj.mjOBJ_CAMERA,
    "key": mujoco.mjtObj.mjOBJ_KEY,
    "geom": mujoco.mjtObj.mjOBJ_GEOM,
}

_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


def read_spec(path: Path) -> mujoco.MjSpec:
    """Read an MJCF or URDF file; links of a URDF that are fixed to others keep their names.

    Raises:
        RobotError: where there is no such file, or MuJoCo cannot read it.
    """
    if not path.is_file():
        raise RobotError(f"there is no robot model {path}")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise RobotError(f"{path} is no robot model that MuJoCo reads: {error}") from error
    spec.compiler.fusestatic = False
    return spec


def compile_spec(spec: mujoco.MjSpec, what: str) -> mujoco.MjModel:
    """Compile, with MuJoCo's complaint as a RobotError."""
    try:
        return spec.compile()
    except ValueError as error:
        raise RobotError(f"MuJoCo cannot compile {what}: {error}") from error


def names(model: mujoco.MjModel, kind: str) -> list[str]:
    """Names of all bodies, joints, sites, … of a model, `kind` in the singular."""
    count = getattr(model, {"joint": "njnt", "camera": "ncam"}.get(kind, f"n{kind}"))
    found = [mujoco.mj_id2name(model, _OBJECTS[kind], i) for i in range(count)]
    return [name for name in found if name]


def find(model: mujoco.MjModel, kinds: tuple[str, ...], name: str, what: str) -> tuple[str, int]:
    """Kind and id of the thing of that name; the first of several kinds that has it.

    Raises:
        RobotError: where nothing has that name; it lists what there is.
    """
    for kind in kinds:
        index = mujoco.mj_name2id(model, _OBJECTS[kind], name)
        if index >= 0:
            return kind, int(index)
    there = "; ".join(f"{kind}: {', '.join(names(model, kind)) or '-'}" for kind in kinds)
    raise RobotError(f"the robot has no {what} {name!r}; it has {there}")


def chain(model: mujoco.MjModel, base_body: int, end_body: int) -> list[int]:
    """Ids of the joints between two bodies, from the base outwards.

    Raises:
        RobotError: where the end does not hang on the base.
    """
    bodies = []
    body = end_body
    while body not in (base_body, 0):
        bodies.append(body)
        body = int(model.body_parentid[body])
    if body != base_body:
        raise RobotError(
            f"{model.body(end_body).name!r} does not hang on {model.body(base_body).name!r}"
        )
    return [
        int(model.body_jntadr[b]) + k for b in reversed(bodies) for k in range(model.body_jntnum[b])
    ]


def check_single_dof(model: mujoco.MjModel, joints: Iterable[int]) -> None:
    """Refuse ball and free joints in an arm or a gripper with a RobotError."""
    for joint in joints:
        if model.jnt_type[joint] not in (_HINGE, _SLIDE):
            raise RobotError(
                f"joint {model.joint(joint).name!r} is neither hinge nor slide; exclude it by "
                f"naming arm_joints"
            )


def joint_range(model: mujoco.MjModel, joint: int) -> tuple[float, float]:
    """Limits of a joint [rad or m], ±infinity without."""
    if not model.jnt_limited[joint]:
        return -np.inf, np.inf
    return float(model.jnt_range[joint, 0]), float(model.jnt_range[joint, 1])


def velocity_limits(
    model: mujoco.MjModel, joints: Iterable[int], path: Path, given: Mapping[str, float]
) -> NDArray[np.float64]:
    """Velocity limits of joints [rad/s or m/s].

    From, in this order: `given`; ``<custom><numeric name="velocity_limit:JOINT" data="…"/>`` of an
    MJCF; ``<limit velocity="…"/>`` of a URDF; 1 rad/s or 0.1 m/s.
    """
    in_urdf = _urdf_velocities(path)
    limits = []
    for joint in joints:
        name = model.joint(joint).name
        numeric = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_NUMERIC, VELOCITY_PREFIX + name)
        if name in given:
            limit = float(given[name])
        elif numeric >= 0:
            limit = float(model.numeric_data[model.numeric_adr[numeric]])
        elif name in in_urdf:
            limit = in_urdf[name]
        else:
            limit = DEFAULT_VELOCITY["slide" if model.jnt_type[joint] == _SLIDE else "hinge"]
        if not (np.isfinite(limit) and limit > 0):
            raise RobotError(f"the velocity limit of {name!r} must be > 0 and finite, got {limit}")
        limits.append(limit)
    return np.array(limits)


def _urdf_velocities(path: Path) -> dict[str, float]:
    root = ElementTree.parse(path).getroot()
    found = {}
    for joint in root.iterfind("joint") if root.tag == "robot" else ():
        limit = joint.find("limit")
        velocity = float(limit.get("velocity", "0")) if limit is not None else 0.0
        if velocity > 0:
            found[joint.get("name", "")] = velocity
    return found
