"""Grasps as tables."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planegrasp.cli.common import console, grasp_row, print_json

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from rich.table import Table

    from planegrasp.geometry import RigidTransform
    from planegrasp.grasping import CanonicalGrasp
    from planegrasp.objects import ObjectModel

__all__ = ["adapted_table", "show_grasps"]


def show_grasps(
    listed: Sequence[tuple[ObjectModel, Sequence[CanonicalGrasp]]],
    library: Path,
    *,
    as_json: bool,
    details: bool = False,
) -> None:
    """Print the grasps of objects as a table, or as JSON."""
    if as_json:
        rows = [{"name": m.name, "grasps": [grasp_row(g) for g in grasps]} for m, grasps in listed]
        print_json({"library": str(library), "objects": rows})
        return
    if not any(grasps for _, grasps in listed):
        console().print("no grasps; teach one with `planegrasp grasp teach`")
        return
    from rich.table import Table

    table = Table(
        "object", "grasp", "gripper x, y, z (m)", "opening (mm)", "from (mm)", "force (N)"
    )
    if details:
        table.add_column("quaternion x, y, z, w")
        table.add_column("approach")
    for model, grasps in listed:
        for i, grasp in enumerate(grasps):
            T = grasp.T_object_gripper
            row = [
                model.name if i == 0 else "",
                grasp.name,
                _numbers(T.translation, 4),
                f"{1000 * grasp.opening:.1f}",
                f"{1000 * grasp.pregrasp_distance:.0f}",
                f"{grasp.force:g}",
            ]
            if details:
                row += [
                    _numbers(T.rotation.as_quat(canonical=True), 4),
                    _numbers(grasp.approach, 3),
                ]
            table.add_row(*row)
    console().print(table)


def adapted_table(
    adapted: Sequence[tuple[CanonicalGrasp, RigidTransform, RigidTransform]],
    T_base_object: RigidTransform,
) -> Table:
    """Where the gripper goes for each grasp: at the grasp, and before it."""
    from rich.table import Table

    table = Table("grasp", "gripper x, y, z (m)", "roll, pitch, yaw (°)", "from x, y, z (m)")
    for grasp, T_base_gripper, T_base_pregrasp in adapted:
        table.add_row(
            grasp.name,
            _numbers(T_base_gripper.translation, 4),
            _numbers(map(math.degrees, grasp.euler(T_base_object)), 1),
            _numbers(T_base_pregrasp.translation, 4),
        )
    return table


def _numbers(values: Iterable[float], digits: int) -> str:
    # Adding 0 makes a rounded -0.0 an ordinary 0.
    return ", ".join(f"{round(float(value), digits) + 0.0:.{digits}f}" for value in values)
