"""The MuJoCo specification of a world: what is in it, and how it is simulated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.simulation._dependencies import mujoco
from planegrasp.simulation.supports import SUPPORT

if TYPE_CHECKING:
    from planegrasp.geometry import RigidTransform
    from planegrasp.objects import ObjectModel
    from planegrasp.robot import Robot
    from planegrasp.simulation.supports import Support

OBJECT, FLOOR, WELD, VIEWPOINT = "object", "floor", "held", "viewpoint"


@dataclass(frozen=True, slots=True)
class WorldConfig:
    """What is not the robot's.

    Attributes:
        mass: of the object [kg].
        friction: Coulomb's coefficient of the object's surface; a finger whose contact parameters
            have priority decides by its own.
        color: of the object's sides without a photograph, RGB 0 … 1.
        floor_height: z of the floor in the world of the robot's model [m]; the PR2's wheels reach
            0.051 m below its base.
        floor_color: RGB 0 … 1.
        timestep: of the simulation [s].
        impratio: how much stiffer friction is than normal forces. Without, what is held creeps.
        viewpoint: optical frame, in the world of the robot's model, from which somebody looks on:
            the site `VIEWPOINT`.
    """

    mass: float = 0.4
    friction: float = 0.6
    color: tuple[float, float, float] = (0.69, 0.55, 0.38)
    floor_height: float = -0.051
    floor_color: tuple[float, float, float] = (0.46, 0.42, 0.38)
    timestep: float = 0.002
    impratio: float = 10.0
    viewpoint: RigidTransform | None = None


def world_spec(
    robot: Robot,
    object_model: ObjectModel,
    T_world_object: RigidTransform,
    support: Support,
    config: WorldConfig,
) -> mujoco.MjSpec:
    """The robot, the floor, the object as a free box, its support, and a weld between the two."""
    spec = robot.spec()
    # Keyframes say where the robot's joints are, not the object's: compiling would refuse them.
    for key in list(spec.keys):
        spec.delete(key)
    option = spec.option
    option.timestep = config.timestep
    option.impratio = config.impratio
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON

    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 0.1],
        pos=[0.0, 0.0, config.floor_height],
        rgba=[*config.floor_color, 1.0],
    )
    if config.viewpoint is not None:
        x, y, z, w = config.viewpoint.rotation.as_quat()
        position = config.viewpoint.translation
        spec.worldbody.add_site(name=VIEWPOINT, pos=position, quat=[w, x, y, z], group=4)
    support.add_to(spec, T_world_object, object_model.outer_body, config.floor_height)
    x, y, z, w = T_world_object.rotation.as_quat()
    box = spec.worldbody.add_body(name=OBJECT, pos=T_world_object.translation, quat=[w, x, y, z])
    box.add_freejoint()
    body = object_model.outer_body
    box.add_geom(
        name=OBJECT,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=np.array(body.size) / 2,
        pos=body.centre,
        mass=config.mass,
        friction=[config.friction, 0.005, 0.0001],
        condim=4,
        solref=[2 * config.timestep, 1.0],
        solimp=[0.95, 0.99, 0.001, 0.5, 2.0],
        rgba=[*config.color, 1.0],
    )
    weld = spec.add_equality(
        name=WELD,
        type=mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_BODY,
        name1=SUPPORT,
        name2=OBJECT,
        # Stiff: the object follows a moving hand, and does not sag under its weight.
        solref=[2.5 * config.timestep, 1.0],
        solimp=[0.99, 0.999, 0.001, 0.5, 2.0],
    )
    # No relative pose (a zero quaternion): the one in which both stand now.
    weld.data[:] = 0.0
    weld.data[10] = 1.0
    spec.add_exclude(bodyname1=SUPPORT, bodyname2=OBJECT)
    return spec
