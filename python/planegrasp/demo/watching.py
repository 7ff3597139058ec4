"""A simulated world that somebody looks at while its time passes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.objects import PlanarFace
from planegrasp.simulation.raycast_camera import RaycastCamera
from planegrasp.simulation.raycast_values import Printed, RaycastConfig
from planegrasp.simulation.world import Hand, Tripod, World, WorldConfig
from planegrasp.simulation.world_spec import FLOOR, VIEWPOINT

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from planegrasp.simulation.experiment import Experiment, Setting

__all__ = ["ONLOOKER", "WatchedWorld", "onlooker_view", "wall", "watched"]

ONLOOKER = PinholeCamera(800, 500, 780.0, 780.0, 399.5, 249.5)
"""The camera of somebody who looks on."""
# Where the onlooker stands and what is in the middle of what is seen, in the world [m].
_EYE, _LOOK_AT = (-0.6, 2.9, 2.0), (0.32, -0.1, 0.68)
# Chequered mats on the floor, all before the cameras: middles, width, and that of a tile [m].
_MATS = ((1.5, 0.0), (-2.1, 0.0))
_MAT_WIDTH, _TILE = 3.6, 0.3
_FLOOR_COLOR = (0.60, 0.58, 0.55)
_LIGHT, _DARK = (176, 171, 163), (160, 155, 147)


class WatchedWorld(World):
    """Calls `watch` whenever `period` seconds have passed.

    Attributes:
        watch: called with nothing; None calls nobody.
        period: [s].
    """

    watch: Callable[[], None] | None = None
    period: float = 0.1
    _due: float = 0.0

    def camera(
        self, camera: PinholeCamera, frame: str | None = None, config: RaycastConfig | None = None
    ) -> RaycastCamera:
        """See `World.camera`; it also sees mats on the floor."""
        plain = super().camera(camera, frame, config)
        name = frame or self.robot.camera_frame or ""
        return RaycastCamera(self.model, camera, name, [*plain.printed, *_mats(self)], plain.config)

    def step(self, seconds: float | None = None) -> None:
        """See `World.step`."""
        super().step(seconds)
        if self.watch is not None and self.time >= self._due:
            self._due = self.time + self.period - 1e-9
            self.watch()


def watched(experiment: Experiment, setting: Setting) -> WatchedWorld:
    """The world of a setting, with somebody in it who looks on from the robot's left."""
    support = Tripod() if setting.hold is None else Hand(setting.hold)
    config = WorldConfig(
        mass=setting.thing.mass, viewpoint=_looking(_EYE, _LOOK_AT), floor_color=_FLOOR_COLOR
    )
    return WatchedWorld(
        experiment.robot, setting.thing.model, setting.T_base_object, support, config
    )


def onlooker_view(world: World) -> RaycastCamera:
    """What somebody at the world's viewpoint sees, without noise."""
    config = RaycastConfig(color_noise=0.0, background_depth=7.0, light=(0.5, 0.9, 1.0))
    return world.camera(ONLOOKER, VIEWPOINT, config)


def wall(camera: PinholeCamera = ONLOOKER) -> NDArray[np.uint8]:
    """A plain wall, a little darker upwards, H×W×3."""
    shade = np.linspace(0.86, 1.0, camera.height)[:, None, None]
    colors = shade * np.array([222.0, 228.0, 234.0])
    return np.broadcast_to(colors, (camera.height, camera.width, 3)).astype(np.uint8)


def _looking(eye: ArrayLike, at: ArrayLike) -> RigidTransform:
    """T_world_camera of a camera at a point that looks at another one, upright (3 each, [m])."""
    position = np.asarray(eye, dtype=np.float64)
    z = np.asarray(at, dtype=np.float64) - position
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    R = Rotation.from_matrix(np.column_stack([x, np.cross(z, x), z]))
    return RigidTransform.from_components(position, R)


def _mats(world: World) -> list[Printed]:
    height = world.config.floor_height
    places = [RigidTransform.from_translation([*middle, height]) for middle in _MATS]
    tiles = _tiles()
    return [
        Printed(FLOOR, PlanarFace("mat", tiles, _MAT_WIDTH, _MAT_WIDTH, place)) for place in places
    ]


def _tiles() -> NDArray[np.uint8]:
    side = 1200
    number = np.arange(side) * _MAT_WIDTH / side // _TILE
    dark = (number[:, None] + number) % 2 == 1
    return np.where(dark[..., None], _DARK, _LIGHT).astype(np.uint8)
