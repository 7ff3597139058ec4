"""Grasps as tables."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rich.table import Table

    from planegrasp.geometry import RigidTransform
    from planegrasp.grasping import CanonicalGrasp
    from planegrasp.objects import ObjectModel

__all__ = ["adapted_table", "grasp_lines", "grasps_table", "numbers"]


def grasps_table(models: Iterable[ObjectModel]) -> Table:
    """The grasps of objects, one a row."""
    from rich.table import Table

    table = Table("object", "grasp", "gripper x, y, z (mm)", "opening (mm)", "force (N)")
    for model in models:
        for i, grasp in enumerate(model.grasps):
            table.add_row(
                model.name if i == 0 else "",
                grasp.name,
                numbers(1000 * grasp.T_object_gripper.translation, 1),
                f"{1000 * grasp.opening:.1f}",
                f"{grasp.force:g}",
            )
    return table


def grasp_lines(model: ObjectModel, grasp: CanonicalGrasp) -> list[str]:
    """Everything of one grasp."""
    T = grasp.T_object_gripper
    values = {
        "gripper in the object, m": numbers(T.translation, 4),
        "quaternion x, y, z, w": numbers(T.rotation.as_quat(canonical=True), 4),
        "opening, m": numbers([grasp.opening], 4),
        "approach, gripper's frame": numbers(grasp.approach, 3),
        "pregrasp distance, m": numbers([grasp.pregrasp_distance], 4),
        "force, N": f"{grasp.force:g}",
    }
    width = max(map(len, values))
    lines = [f"{what:{width}} {value}" for what, value in values.items()]
    return [f"[bold]{model.name}[/] {grasp.name}", *lines]


def adapted_table(grasps: Iterable[CanonicalGrasp], T_base_object: RigidTransform) -> Table:
    """Where the gripper goes for each grasp of an object at a pose."""
    from rich.table import Table

    table = Table("grasp", "gripper x, y, z (m)", "roll, pitch, yaw (°)")
    for grasp in grasps:
        table.add_row(
            grasp.name,
            numbers(grasp.adapt(T_base_object).translation, 4),
            numbers(map(math.degrees, grasp.euler(T_base_object)), 1),
        )
    return table


def numbers(values: Iterable[float], digits: int) -> str:
    """Numbers with so many decimals, separated by commas."""
    # Adding 0 makes a rounded -0.0 an ordinary 0.
    return ", ".join(f"{round(float(value), digits) + 0.0:.{digits}f}" for value in values)
