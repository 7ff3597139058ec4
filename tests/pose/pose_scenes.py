"""Faces in front of a camera with exact truth: image points, depth, and what covers them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.pose import FaceObservation
from planegrasp.rgbd import RGBDFrame

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

CAMERA = PinholeCamera(width=640, height=480, fx=525.0, fy=525.0, cx=319.5, cy=239.5)
FRONTAL = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))

# Kinect v1: disparity = 580 px · 0.075 m / z, noise 0.1 px, quantised to 1/8 px.
DISPARITY_TIMES_DEPTH = 580.0 * 0.075
DISPARITY_NOISE = 0.1
DISPARITY_STEP = 0.125


@dataclass(frozen=True)
class Rectangle:
    """A flat rectangle [m] in the camera frame: z out of it, origin at its centre."""

    T_camera_face: RigidTransform
    width: float = 0.2
    height: float = 0.2

    def depth_along(self, rays: NDArray[np.float64]) -> NDArray[np.float64]:
        """Exact depth where rays (N×3, z = 1) meet the rectangle, elsewhere infinity."""
        normal = self.T_camera_face.rotation.as_matrix()[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            z = (normal @ self.T_camera_face.translation) / (rays @ normal)
        local = self.T_camera_face.inv().apply(rays * z[:, None])
        inside = (np.abs(local[:, 0]) <= self.width / 2) & (np.abs(local[:, 1]) <= self.height / 2)
        return np.where(inside & (z > 0), z, np.inf)


@dataclass(frozen=True)
class Scene:
    """One object with its faces, and what covers it, before a camera."""

    T_camera_object: RigidTransform
    faces: tuple[RigidTransform, ...] = (RigidTransform.identity(),)
    width: float = 0.2
    height: float = 0.2
    camera: PinholeCamera = CAMERA
    covers: tuple[Rectangle, ...] = ()
    background: float = 2.0
    margin: float = 0.0
    points: int = 200
    pixel_noise: float = 0.5
    seed: int = 0
    rng: np.random.Generator = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rng", np.random.default_rng(self.seed))

    def rectangles(self) -> list[Rectangle]:
        """The faces in the camera frame, by `margin` larger than they are taught."""
        size = (self.width + self.margin, self.height + self.margin)
        return [Rectangle(self.T_camera_object * T, *size) for T in self.faces]

    def exact_depth(self) -> NDArray[np.float64]:
        """Depth [m] of the nearest surface at every pixel."""
        return self._nearest(all_rays(self.camera)).reshape(self.camera.height, self.camera.width)

    def _nearest(self, rays: NDArray[np.float64]) -> NDArray[np.float64]:
        layers = [r.depth_along(rays) for r in [*self.rectangles(), *self.covers]]
        return np.minimum(np.minimum.reduce(layers), self.background)

    def frame(self, depth: NDArray[np.floating] | None = None, *, bias: float = 1.0) -> RGBDFrame:
        """The frame, by default with the depth of a Kinect v1."""
        if depth is None:
            depth = kinect_depth(self.exact_depth(), self.rng) * bias
        color = np.zeros((self.camera.height, self.camera.width, 3), np.uint8)
        return RGBDFrame(color=color, depth=depth.astype(np.float32), camera=self.camera)

    def frame_without_depth(self) -> RGBDFrame:
        return replace(self.frame(np.zeros((self.camera.height, self.camera.width))), depth=None)

    def observations(self) -> list[FaceObservation]:
        """Noisy inliers of every face, none where something covers the face."""
        return [self._observe(T) for T in self.faces]

    def _observe(self, T_object_face: RigidTransform) -> FaceObservation:
        T = self.T_camera_object * T_object_face
        half = np.array([self.width, self.height]) / 2
        face = self.rng.uniform(-half, half, (self.points, 2))
        in_camera = T.apply(np.column_stack([face, np.zeros(len(face))]))
        observed = self.camera.project(in_camera)
        limit = (self.camera.width - 0.5, self.camera.height - 0.5)
        inside = np.all((observed > -0.5) & (observed < limit), axis=1)
        nearest = self._nearest(in_camera / in_camera[:, 2:])
        visible = inside & (nearest > in_camera[:, 2] - 1e-6)
        observed = observed[visible] + self.rng.normal(0, self.pixel_noise, (visible.sum(), 2))
        return FaceObservation(
            T_object_face=T_object_face,
            width=self.width,
            height=self.height,
            face_points=face[visible],
            image_points=self.camera.undistort(observed),
            homography=exact_homography(self.camera, T),
        )


@cache
def all_rays(camera: PinholeCamera) -> NDArray[np.float64]:
    """Rays of all pixels, row by row."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    return camera.rays(np.column_stack([u.ravel(), v.ravel()]))


def tilted(
    degrees: float, azimuth: float = 0.0, roll: float = 0.0, distance: float = 0.7
) -> RigidTransform:
    """A face at this distance [m], tilted about the axis at `azimuth` in its plane [deg]."""
    axis = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0.0])
    tilt = Rotation.from_rotvec(axis * np.radians(degrees))
    turn = Rotation.from_rotvec([0.0, 0.0, np.radians(roll)])
    return RigidTransform.from_components([0.02, -0.03, distance], tilt * FRONTAL * turn)


def exact_homography(camera: PinholeCamera, T_camera_face: RigidTransform) -> NDArray[np.float64]:
    """From face points [m] to undistorted pixels."""
    T = T_camera_face.as_matrix()
    H = camera.matrix @ T[:3, [0, 1, 3]]
    return H / H[2, 2]


def kinect_depth(depth: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """What a Kinect v1 measures of an exact depth image."""
    disparity = DISPARITY_TIMES_DEPTH / depth + rng.normal(0, DISPARITY_NOISE, depth.shape)
    return DISPARITY_TIMES_DEPTH / (np.rint(disparity / DISPARITY_STEP) * DISPARITY_STEP)


def errors(estimated: RigidTransform, true: RigidTransform) -> tuple[float, float]:
    """Rotation [deg] and translation [mm] between two poses."""
    angle = np.degrees((estimated.rotation.inv() * true.rotation).magnitude())
    return float(angle), float(1000 * np.linalg.norm(estimated.translation - true.translation))


def taught_too_small(face: FaceObservation, error: float) -> FaceObservation:
    """The face as seen by someone who taught it 1 / (1 + error) of its true size."""
    scale = 1.0 + error
    return replace(
        face,
        width=face.width / scale,
        height=face.height / scale,
        face_points=face.face_points / scale,
        homography=face.homography @ np.diag([scale, scale, 1.0]),
    )


def cover_of(
    T_camera_face: RigidTransform, share: float, nearer: float, size: float = 0.2
) -> Rectangle:
    """Something before the lower `share` of a square face, `nearer` to the viewer [m]."""
    shift = RigidTransform.from_translation([0.0, -size / 2 * (1 - share), nearer])
    return Rectangle(T_camera_face * shift, size * 1.5, size * share)


def medians(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    rotation, translation = np.median(np.array(pairs), axis=0)
    return float(rotation), float(translation)
