"""What touches what in the simulated world, and how hard."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.simulation._dependencies import mujoco
from planegrasp.simulation.supports import SUPPORT
from planegrasp.simulation.world_spec import FLOOR, OBJECT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.robot import Robot

GROUPS = ("robot", "fingers", "object", "support", "floor")


@dataclass(frozen=True, slots=True)
class Contact:
    """Two geoms that touch.

    Attributes:
        first, second: names of the geoms, or of their bodies where they have none, in the order
            of the groups that were asked for.
        force: normal force [N].
        depth: how far they are inside of each other [m].
    """

    first: str
    second: str
    force: float
    depth: float


def geom_groups(model: mujoco.MjModel, robot: Robot) -> tuple[str, ...]:
    """For each geom of a world which of `GROUPS` it belongs to."""
    joints = robot.gripper.joints if robot.gripper is not None else ()
    fingers = {int(model.joint(name).bodyid[0]) for name in joints}
    own = {model.body(SUPPORT).id: "support", model.body(OBJECT).id: "object"}
    groups = []
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        if body in own:
            groups.append(own[body])
        elif model.geom(geom).name == FLOOR:
            groups.append("floor")
        else:
            while body not in fingers and body != 0:
                body = int(model.body_parentid[body])
            groups.append("fingers" if body in fingers else "robot")
    return tuple(groups)


def contacts(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    groups: Sequence[str],
    wanted: tuple[str, str],
    min_force: float,
) -> tuple[Contact, ...]:
    """The contacts between two groups, see `World.contacts`."""
    for group in wanted:
        if group not in GROUPS:
            raise InvalidInputError(f"there is no group {group!r}; there are: {', '.join(GROUPS)}")
    found = []
    force = np.zeros(6)
    for index, contact in enumerate(data.contact):
        pair = [int(geom) for geom in contact.geom]
        if (groups[pair[0]], groups[pair[1]]) != wanted:
            pair.reverse()
        if (groups[pair[0]], groups[pair[1]]) != wanted or contact.exclude:
            continue
        mujoco.mj_contactForce(model, data, index, force)
        if force[0] >= min_force:
            first, second = (_name(model, geom) for geom in pair)
            found.append(Contact(first, second, float(force[0]), -float(contact.dist)))
    return tuple(found)


def _name(model: mujoco.MjModel, geom: int) -> str:
    return str(model.geom(geom).name or model.body(model.geom_bodyid[geom]).name)
