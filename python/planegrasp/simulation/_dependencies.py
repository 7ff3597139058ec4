"""MuJoCo, or an error that says what to install."""

from __future__ import annotations

from planegrasp.errors import MissingExtraError

try:
    import mujoco
except ImportError as error:
    raise MissingExtraError("the simulated world", "robot") from error

__all__ = ["mujoco"]
