"""Where the rays of a pinhole camera meet the geoms of a MuJoCo scene: exact, without OpenGL.

Depth is along the optical axis: rays have z = 1 in the camera's frame, so the parameter of the hit
that MuJoCo returns *is* the depth.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import Rotation
from planegrasp.simulation._dependencies import mujoco

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera, RigidTransform

    Float64Array = NDArray[np.float64]

# Nothing nearer than this along the optical axis counts for the outline of a geom in the image [m].
_NEAR = 0.02
_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
_EDGES = [(i, j) for i in range(8) for j in range(i) if np.sum(_CORNERS[i] != _CORNERS[j]) == 1]


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """What N rays meet.

    Attributes:
        depth: N, along the optical axis [m]; infinite where nothing is met.
        geom: N int32 geom ids, -1 where nothing is met.
        facing: N, cosine of the angle between the surface's normal and the light.
    """

    depth: Float64Array
    geom: NDArray[np.int32]
    facing: Float64Array


class Raycaster:
    """The rays of one camera through one model."""

    def __init__(
        self,
        model: mujoco.MjModel,
        camera: PinholeCamera,
        *,
        groups: Sequence[int],
        light: Sequence[float],
    ) -> None:
        """Prepare one ray a pixel.

        Args:
            model: of the scene.
            camera: intrinsics.
            groups: geom groups that are seen.
            light: direction towards the light, world frame, of any length.
        """
        self.camera = camera
        self.light = np.array(light, np.float64) / np.linalg.norm(light)
        self._model = model
        self._groups = np.zeros(mujoco.mjNGROUP, np.uint8)
        self._groups[list(groups)] = 1
        u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
        self.rays = camera.rays(np.column_stack([u.ravel(), v.ravel()]))
        is_plane = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
        seen = self._groups[model.geom_group].astype(bool)
        self._planes = np.flatnonzero(seen & is_plane).tolist()
        self._others = np.flatnonzero(seen & ~is_plane)

    def cast(self, data: mujoco.MjData, T_world_camera: RigidTransform, rays: Float64Array) -> Hits:
        """Intersect rays with all visible geoms.

        Args:
            data: with positions computed (`mj_forward` or a step).
            T_world_camera: pose of the optical frame.
            rays: N×3 directions in the camera's frame with z = 1.
        """
        translation, rotation = T_world_camera.as_components()
        directions = rays @ rotation.as_matrix().T
        count = len(rays)
        depth = np.empty(count)
        geom = np.empty(count, np.int32)
        normal = np.zeros(3 * count)
        if count:
            mujoco.mj_multiRay(
                self._model,
                data,
                pnt=translation,
                vec=directions.ravel(),
                geomgroup=self._groups,
                flg_static=1,
                bodyexclude=-1,
                geomid=geom,
                dist=depth,
                normal=normal,
                nray=count,
                cutoff=mujoco.mjMAXVAL,
            )
        depth[geom < 0] = np.inf
        return Hits(depth, geom, normal.reshape(-1, 3) @ self.light)

    def cast_image(self, data: mujoco.MjData, T_world_camera: RigidTransform) -> Hits:
        """The same as `cast` for one ray a pixel, row by row, in less time.

        MuJoCo tests every ray against every body's bounding sphere, which is most of the time. Only
        pixels inside of the outline of some geom's bounding box need that; in the others there can
        be nothing but planes, which have a formula.
        """
        count = len(self.rays)
        hits = Hits(np.full(count, np.inf), np.full(count, -1, np.int32), np.zeros(count))
        for plane in self._planes:
            self._meet_plane(plane, data, T_world_camera, hits)
        chosen = np.flatnonzero(self._candidates(data, T_world_camera))
        near = self.cast(data, T_world_camera, self.rays[chosen])
        hits.depth[chosen], hits.geom[chosen] = near.depth, near.geom
        hits.facing[chosen] = near.facing
        return hits

    def _candidates(self, data: mujoco.MjData, T_world_camera: RigidTransform) -> NDArray[np.bool_]:
        """Pixels in which some geom other than a plane may be seen (H×W)."""
        mask = np.zeros((self.camera.height, self.camera.width), np.uint8)
        if self.camera.is_distorted:
            # Straight edges become curves: the outlines would have to follow them.
            return ~mask.astype(bool)
        translation, rotation = T_world_camera.as_components()
        R = rotation.as_matrix()
        for geom in self._others:
            aabb = self._model.geom_aabb[geom]
            local = aabb[:3] + _CORNERS * aabb[3:]
            world = data.geom_xpos[geom] + local @ data.geom_xmat[geom].reshape(3, 3).T
            _fill_outline((world - translation) @ R, self.camera, mask)
        return mask.astype(bool)

    def _meet_plane(
        self, plane: int, data: mujoco.MjData, T_world_camera: RigidTransform, hits: Hits
    ) -> None:
        """Put a plane before what is farther. MuJoCo's planes are seen from their positive side."""
        translation, rotation = T_world_camera.as_components()
        R_world_plane = data.geom_xmat[plane].reshape(3, 3)
        start = (translation - data.geom_xpos[plane]) @ R_world_plane
        if start[2] <= 0:
            return
        R_camera_plane = rotation.as_matrix().T @ R_world_plane
        falling = self.rays @ R_camera_plane[:, 2]
        with np.errstate(divide="ignore"):
            z = np.where(falling < 0, -start[2] / falling, np.inf)
        hit = z < hits.depth
        for axis, half in enumerate(self._model.geom_size[plane, :2]):
            if half > 0:
                hit &= np.abs(start[axis] + z * (self.rays @ R_camera_plane[:, axis])) <= half
        np.copyto(hits.depth, z, where=hit)
        hits.geom[hit] = plane
        hits.facing[hit] = R_world_plane[:, 2] @ self.light


def _fill_outline(corners: Float64Array, camera: PinholeCamera, mask: NDArray[np.uint8]) -> None:
    """Set the pixels that a box of eight corners (camera frame) can cover, and few others."""
    z = corners[:, 2]
    if np.all(z <= _NEAR):
        return
    if np.all(z > _NEAR):
        x = corners[:, :2] / z[:, None] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
        limit = 8 * max(camera.width, camera.height)
        if np.abs(x).max() < limit:
            hull = cv2.convexHull(np.rint(x).astype(np.int32))
            cv2.fillConvexPoly(mask, hull, 1)
            cv2.polylines(mask, [hull], isClosed=True, color=1, thickness=5)
            return
    # Partly behind the camera: the rectangle around what lies before it.
    points = [corners[z > _NEAR]]
    for i, j in _EDGES:
        if (z[i] > _NEAR) != (z[j] > _NEAR):
            share = (_NEAR - z[i]) / (z[j] - z[i])
            points.append((corners[i] + share * (corners[j] - corners[i]))[None])
    inside = np.concatenate(points)
    x = inside[:, :2] / inside[:, 2:] * (camera.fx, camera.fy) + (camera.cx, camera.cy)
    size = (camera.width, camera.height)
    x0, y0 = np.clip(np.floor(x.min(axis=0)) - 2, 0, size).astype(int)
    x1, y1 = np.clip(np.ceil(x.max(axis=0)) + 3, 0, size).astype(int)
    mask[y0:y1, x0:x1] = 1


def named(model: mujoco.MjModel, kind: str, name: str) -> int:
    """The id of a thing of a kind ("body", "geom", "site", "joint", …) in a model.

    Raises:
        InvalidInputError: there is none of this name.
    """
    found = int(mujoco.mj_name2id(model, mujoco.mju_str2Type(kind), name))
    if found < 0:
        raise InvalidInputError(f"the model has no {kind} {name!r}")
    return found


def distance_to_surface(model: mujoco.MjModel, geom: int, T_body_face: RigidTransform) -> float:
    """How far a face's centre lies inside of a geom's surface along its z axis [m].

    Negative outside; infinite where the face's axis does not meet the geom.
    """
    translation, rotation = T_body_face.as_components()
    out = rotation.as_matrix()[:, 2]
    w, x, y, z = model.geom_quat[geom]
    start = 1.0  # from far outside, so that the outer surface is met
    met = mujoco.mju_rayGeom(
        model.geom_pos[geom],
        Rotation.from_quat([x, y, z, w]).as_matrix().ravel(),
        model.geom_size[geom],
        translation + start * out,
        -out,
        model.geom_type[geom],
    )
    return start - float(met) if met >= 0 else np.inf
