"""Grasps that were shown once, and where the gripper goes when the object lies elsewhere."""

from __future__ import annotations

from planegrasp.grasping.canonical import CanonicalGrasp, check_unique
from planegrasp.grasping.clearance import GripperShape, check_against_body
from planegrasp.grasping.symmetry import symmetric_variants

__all__ = [
    "CanonicalGrasp",
    "GripperShape",
    "check_against_body",
    "check_unique",
    "symmetric_variants",
]
