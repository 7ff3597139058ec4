"""Grasps that are as good as a taught one, because gripper or object looks the same when turned."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import GraspError
from planegrasp.geometry import RigidTransform, Rotation, rotation_angle

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planegrasp.grasping.canonical import CanonicalGrasp

__all__ = ["symmetric_variants"]

_AXES = "xyz"
# Poses nearer than this are the same grasp: far below what a gripper can tell apart.
_SAME_POSITION = 1e-4
_SAME_ANGLE = 1e-3


def symmetric_variants(
    grasp: CanonicalGrasp,
    *,
    flip: bool = True,
    axes: Iterable[str] = (),
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> list[CanonicalGrasp]:
    """The grasp itself and its symmetric variants, without duplicates.

    A parallel gripper looks the same when it is turned by 180° about the axis out of its palm:
    "NAME/flipped". An object that looks the same when it is turned by 180° about its x, y or z can
    be grasped there too: "NAME/x", "NAME/y/flipped". Two such axes imply the third.

    Args:
        grasp: as it was taught.
        flip: whether the gripper is symmetric.
        axes: about which axes, of "x", "y" and "z" of its frame, the object is symmetric.
        centre: point on these axes in the object's frame [m], as `BoxBody.centre`.

    Raises:
        GraspError: for another axis.
    """
    found = [grasp]
    for label, turn in _turns(axes, centre):
        for suffix in ("", "/flipped") if flip else ("",):
            variant = _flipped(grasp) if suffix else grasp
            candidate = replace(
                variant,
                name=f"{grasp.name}{label}{suffix}",
                T_object_gripper=turn * variant.T_object_gripper,
            )
            if not any(_same(candidate, other) for other in found):
                found.append(candidate)
    return found


def _turns(
    axes: Iterable[str], centre: tuple[float, float, float]
) -> list[tuple[str, RigidTransform]]:
    chosen = set(axes)
    unknown = sorted(chosen - set(_AXES))
    if unknown:
        raise GraspError(f"an object is symmetric about its x, y or z, not {unknown[0]!r}")
    if len(chosen) == 2:
        chosen = set(_AXES)
    there = RigidTransform.from_translation(centre)
    turns = [("", RigidTransform.identity())]
    for axis in sorted(chosen):
        half_turn = _half_turn(axis)
        turns.append((f"/{axis}", there * half_turn * there.inv()))
    return turns


def _half_turn(axis: str) -> RigidTransform:
    """By 180°, without the rounding of π."""
    return RigidTransform.from_rotation(
        Rotation.from_quat([float(axis == one) for one in _AXES] + [0.0])
    )


def _flipped(grasp: CanonicalGrasp) -> CanonicalGrasp:
    """Turned about the axis out of the palm; its way over the object stays what it was."""
    x, y, z = grasp.approach
    return replace(
        grasp,
        T_object_gripper=grasp.T_object_gripper * _half_turn("x"),
        approach=(x, 0.0 - y, 0.0 - z),
    )


def _same(a: CanonicalGrasp, b: CanonicalGrasp) -> bool:
    Ta, Tb = a.T_object_gripper, b.T_object_gripper
    return (
        float(np.linalg.norm(Ta.translation - Tb.translation)) < _SAME_POSITION
        and rotation_angle(Ta.rotation, Tb.rotation) < _SAME_ANGLE
        and np.allclose(a.approach, b.approach, atol=_SAME_ANGLE)
    )
