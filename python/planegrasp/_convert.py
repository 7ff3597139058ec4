"""Values of several rooms as the core's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp import _core

if TYPE_CHECKING:
    from planegrasp.geometry import PinholeCamera


def to_core_camera(camera: PinholeCamera) -> _core.Camera:
    """The camera as the core takes it."""
    return _core.Camera(
        camera.width,
        camera.height,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        camera.coefficients.tolist(),
    )
