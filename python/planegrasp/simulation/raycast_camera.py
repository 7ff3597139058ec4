"""An RGB-D camera in a MuJoCo scene, by ray casting: no OpenGL, no display, exact depth.

One ray a pixel gives depth and what is seen. Where neighbouring pixels see different things, more
rays share the pixel out between them. Photographs on flat sides are averaged over each pixel by the
sampling that `render` uses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.rgbd import RGBDFrame
from planegrasp.simulation._dependencies import mujoco
from planegrasp.simulation.raycast import Raycaster, distance_to_surface, named
from planegrasp.simulation.raycast_values import Printed, RaycastConfig, RaycastRendering
from planegrasp.simulation.rectangle import Rectangle, level_of_detail, polygon_area, sample

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.simulation.raycast import Hits

# A hit this near to a photograph's plane, on the geom that carries it, shows the photograph [m].
_ON_PLANE = 1e-6
# MuJoCo takes a material's colour where a geom has this one.
_UNSET_RGBA = (0.5, 0.5, 0.5, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """What the rays of one frame are coloured with; images have a row of RGB a pixel."""

    T_world_camera: RigidTransform
    T_camera_body: tuple[RigidTransform, ...]
    shown: tuple[Rectangle, ...]
    textures: tuple[NDArray[np.float32], ...]
    wall: NDArray[np.float32]


class RaycastCamera:
    """An RGB-D camera whose optical frame (x right, y down, z forward) is a site or body."""

    def __init__(
        self,
        model: mujoco.MjModel,
        camera: PinholeCamera,
        frame: str,
        printed: Sequence[Printed] = (),
        config: RaycastConfig | None = None,
    ) -> None:
        """Prepare the rays.

        Args:
            model: of the scene.
            camera: intrinsics; distortion is rendered.
            frame: name of the site or body with the optical frame.
            printed: the photographs in the scene.
            config: defaults where None.

        Raises:
            InvalidInputError: the model has no such frame or geom, or a photograph does not lie on
                the surface of its geom.
        """
        self.camera = camera
        self.config = config or RaycastConfig()
        self.printed = tuple(printed)
        self._model = model
        is_site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, frame) >= 0
        self._prefix = "site_x" if is_site else "x"
        self._frame = named(model, "site" if is_site else "body", frame)
        self._geoms = [named(model, "geom", p.geom) for p in self.printed]
        for geom, on in zip(self._geoms, self.printed, strict=True):
            _check_on_surface(model, geom, on)
        self._rgb = _geom_colors(model)
        self._caster = Raycaster(model, camera, groups=self.config.groups, light=self.config.light)

    def T_world_camera(self, data: mujoco.MjData) -> RigidTransform:
        """Pose of the optical frame."""
        position = getattr(data, f"{self._prefix}pos")[self._frame]
        matrix = getattr(data, f"{self._prefix}mat")[self._frame].reshape(3, 3)
        return RigidTransform.from_components(position, Rotation.from_matrix(matrix))

    def render(
        self,
        data: mujoco.MjData,
        rng: np.random.Generator,
        *,
        background: NDArray[np.uint8] | None = None,
        name: str = "",
        timestamp: float | None = None,
    ) -> RaycastRendering:
        """See the scene as it stands.

        Args:
            data: with positions computed (`mj_forward` or a step).
            rng: for the sensor noise.
            background: H×W×3 uint8 RGB, stretched over the image; mid grey where None.
            name: of the frame.
            timestamp: of the frame [s].
        """
        shape = (self.camera.height, self.camera.width)
        view = self._view(data, background)
        hits = self._caster.cast_image(data, view.T_world_camera)
        owners = self._owners(hits, self._caster.rays, view.shown)
        image = self._colors(hits, owners, np.arange(len(owners)), view)
        edges = np.flatnonzero(_edges(hits.geom.reshape(shape), owners.reshape(shape)))
        image[edges] = self._shared_out(edges, data, view)

        noisy = rng.standard_normal((*shape, 3), np.float32)
        noisy *= np.float32(self.config.color_noise)
        noisy += image.reshape(noisy.shape)
        np.clip(np.rint(noisy, out=noisy), 0, 255, out=noisy)
        depth = np.minimum(hits.depth, self.config.background_depth).reshape(shape)
        frame = RGBDFrame(
            color=noisy.astype(np.uint8),
            depth=self.config.depth_sensor.measure(depth, rng),
            camera=self.camera,
            name=name,
            timestamp=timestamp,
        )
        corners = tuple(
            self.camera.project(r.corners) if r.faces_camera else None for r in view.shown
        )
        return RaycastRendering(
            frame=frame,
            true_depth=depth,
            geoms=self._seen(hits).reshape(shape),
            owners=owners.reshape(shape),
            visible=tuple(
                float(np.count_nonzero(owners == i) / max(polygon_area(c), 1.0))
                if c is not None
                else 0.0
                for i, c in enumerate(corners)
            ),
            corners=corners,
            T_camera_body=view.T_camera_body,
            T_world_camera=view.T_world_camera,
        )

    def _view(self, data: mujoco.MjData, background: NDArray[np.uint8] | None) -> _View:
        T_world_camera = self.T_world_camera(data)
        bodies = [
            T_world_camera.inv()
            * RigidTransform.from_components(
                data.xpos[body], Rotation.from_matrix(data.xmat[body].reshape(3, 3))
            )
            for body in self._model.geom_bodyid[self._geoms]
        ]
        shown = [
            Rectangle(p.face.image, p.face.width, p.face.height, T * p.face.T_object_face)
            for p, T in zip(self.printed, bodies, strict=True)
        ]
        return _View(
            T_world_camera,
            tuple(bodies),
            tuple(shown),
            tuple(self._texture(rectangle, T_world_camera) for rectangle in shown),
            self._wall(background),
        )

    def _seen(self, hits: Hits) -> NDArray[np.int32]:
        """Geom ids, -1 for what the wall hides."""
        return np.where(hits.depth < self.config.background_depth, hits.geom, -1).astype(np.int32)

    def _owners(
        self, hits: Hits, rays: NDArray[np.float64], shown: Sequence[Rectangle]
    ) -> NDArray[np.int32]:
        """Which photograph each ray meets, -1 for none."""
        owners = np.full(len(rays), -1, np.int32)
        seen = self._seen(hits)
        for index, (geom, rectangle) in enumerate(zip(self._geoms, shown, strict=True)):
            if not rectangle.faces_camera:
                continue
            on_geom = np.flatnonzero(seen == geom)
            translation, rotation = rectangle.T_camera_rectangle.as_components()
            points = rays[on_geom] * hits.depth[on_geom, None]
            x = np.abs((points - translation) @ rotation.as_matrix())
            inside = (
                (x[:, 2] < _ON_PLANE)
                & (x[:, 0] <= rectangle.width / 2)
                & (x[:, 1] <= rectangle.height / 2)
            )
            owners[on_geom[inside]] = index
        return owners

    def _wall(self, background: NDArray[np.uint8] | None) -> NDArray[np.float32]:
        """The background, one row of RGB a pixel."""
        size = (self.camera.width, self.camera.height)
        if background is None:
            return np.full((size[0] * size[1], 3), 128.0, np.float32)
        resized = cv2.resize(background, size, interpolation=cv2.INTER_AREA)
        return np.asarray(resized, np.float32).reshape(-1, 3)

    def _texture(self, rectangle: Rectangle, T_world_camera: RigidTransform) -> NDArray[np.float32]:
        """The lit photograph in the image: a row of RGB for each pixel, 0 where it is not."""
        size = (self.camera.width, self.camera.height)
        image = np.zeros((size[1], size[0], 3), np.float32)
        if not rectangle.faces_camera:
            return image.reshape(-1, 3)
        corners = self.camera.project(rectangle.corners)
        x0, y0 = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 1, 0)
        x1, y1 = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 2, size)
        if x0 < x1 and y0 < y1:
            texture, samples = level_of_detail(rectangle, corners)
            color, coverage = sample(rectangle, texture, self.camera, (x0, y0, x1, y1), samples)
            normal = T_world_camera.rotation.apply(
                rectangle.T_camera_rectangle.rotation.as_matrix()[:, 2]
            )
            lit = self._brightness(normal @ self._caster.light)
            image[y0:y1, x0:x1] = lit * color / np.maximum(coverage, 1e-6)[..., None]
        return image.reshape(-1, 3)

    def _brightness(self, facing: NDArray[np.float64]) -> NDArray[np.float32]:
        """Lambert's cosine law with ambient light, of the cosines between normals and light."""
        ambient = self.config.ambient
        return np.asarray(ambient + (1.0 - ambient) * np.maximum(facing, 0.0), np.float32)

    def _colors(
        self,
        hits: Hits,
        owners: NDArray[np.int32],
        pixels: NDArray[np.intp],
        view: _View,
    ) -> NDArray[np.float32]:
        """N×3 colours of rays in these pixels."""
        seen = self._seen(hits)
        colors = np.take(self._rgb, seen, axis=0)
        colors *= self._brightness(hits.facing)[:, None]
        empty = seen < 0
        colors[empty] = view.wall[pixels[empty]]
        for index, texture in enumerate(view.textures):
            mine = owners == index
            colors[mine] = texture[pixels[mine]]
        return colors

    def _shared_out(
        self, edges: NDArray[np.intp], data: mujoco.MjData, view: _View
    ) -> NDArray[np.float32]:
        """N×3 mean colours over the squares of the pixels at edges."""
        samples = self.config.edge_samples
        rows, columns = np.divmod(edges, self.camera.width)
        offsets = _rooks(samples)
        u = (columns[:, None] + offsets[:, 0]).ravel()
        v = (rows[:, None] + offsets[:, 1]).ravel()
        rays = self.camera.rays(np.column_stack([u, v]))
        hits = self._caster.cast(data, view.T_world_camera, rays)
        owners = self._owners(hits, rays, view.shown)
        colors = self._colors(hits, owners, np.repeat(edges, samples), view)
        return np.asarray(colors.reshape(-1, samples, 3).mean(axis=1))


def _check_on_surface(model: mujoco.MjModel, geom: int, printed: Printed) -> None:
    """Refuse a photograph whose centre is not on its geom's surface: no ray would meet it."""
    distance = abs(distance_to_surface(model, geom, printed.face.T_object_face))
    if not distance < _ON_PLANE:
        raise InvalidInputError(
            f"face {printed.face.name!r} lies {distance:.4g} m off the surface of geom "
            f"{printed.geom!r}: its T_object_face is the pose of the face in the geom's body"
        )


def _geom_colors(model: mujoco.MjModel) -> NDArray[np.float32]:
    """RGB 0 … 255 of every geom, and a last row for none."""
    rgba = model.geom_rgba.copy()
    unset = np.all(np.isclose(rgba, _UNSET_RGBA), axis=1) & (model.geom_matid >= 0)
    rgba[unset] = model.mat_rgba[model.geom_matid[unset]]
    return np.vstack([255.0 * rgba[:, :3], np.zeros(3)]).astype(np.float32)


def _edges(geoms: NDArray[np.int32], owners: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Pixels beside which another thing is seen (H×W)."""
    label = (geoms * 64 + owners + 1).astype(np.float32)
    block = np.ones((3, 3), np.uint8)
    return np.asarray(cv2.dilate(label, block) != cv2.erode(label, block))


def _rooks(count: int) -> NDArray[np.float64]:
    """Offsets in a pixel's square, -½ … ½ (N×2), of which no two share a row or a column."""
    i = np.arange(count)
    # The golden ratio's multiples order the columns so that neighbours in rows are far apart.
    order = np.argsort(np.argsort((i * 0.6180339887498949) % 1.0))
    return (np.column_stack([i, order]) + 0.5) / count - 0.5
