"""A flat textured rectangle, and the mean of its texture over every pixel that shows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera, RigidTransform

# More samples a pixel side than this cost time without a visible difference.
_MOST_SAMPLES = 12


@dataclass(frozen=True, slots=True, eq=False)
class Rectangle:
    """A flat textured rectangle.

    Attributes:
        texture: h×w×3 uint8 RGB.
        width: along its x axis [m].
        height: along its y axis [m].
        T_camera_rectangle: pose of its centre, x right, y up, z towards the textured side.
    """

    texture: NDArray[np.uint8]
    width: float
    height: float
    T_camera_rectangle: RigidTransform

    @property
    def corners(self) -> NDArray[np.float64]:
        """4×3 corners in the camera frame [m], as printed: top-left, then clockwise."""
        x, y = self.width / 2, self.height / 2
        points = np.array([[-x, y, 0.0], [x, y, 0.0], [x, -y, 0.0], [-x, -y, 0.0]])
        return np.asarray(self.T_camera_rectangle.apply(points), dtype=np.float64)

    @property
    def faces_camera(self) -> bool:
        """Whether its textured side is turned towards the camera, all of it in front."""
        translation, rotation = self.T_camera_rectangle.as_components()
        normal = rotation.as_matrix()[:, 2]
        return bool(normal @ translation < 0 and np.all(self.corners[:, 2] > 1e-3))


def level_of_detail(
    rectangle: Rectangle, corners: NDArray[np.float64]
) -> tuple[NDArray[np.uint8], int]:
    """A texture shrunk to what the image can show, and the samples a pixel side that it needs.

    The direction that is compressed least decides how far the texture is shrunk (isotropically);
    the direction that is compressed most decides the number of samples.
    """
    h, w = rectangle.texture.shape[:2]
    top, right, bottom, left = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    widest, tallest = max(top, bottom), max(left, right)
    least = min(w / max(widest, 1.0), h / max(tallest, 1.0))
    shrink = max(1.0, least / 2.0)
    texture = rectangle.texture
    if shrink > 1.0:
        size = (max(8, round(w / shrink)), max(8, round(h / shrink)))
        texture = cv2.resize(texture, size, interpolation=cv2.INTER_AREA).astype(np.uint8)
    area = polygon_area(corners)
    most = texture.shape[0] * texture.shape[1] / max(area, 1.0) / max(least / shrink, 0.5)
    return texture, int(np.clip(np.ceil(most), 4, _MOST_SAMPLES))


def sample(
    rectangle: Rectangle,
    texture: NDArray[np.uint8],
    camera: PinholeCamera,
    roi: tuple[int, int, int, int],
    samples: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Premultiplied colour and coverage, averaged over samples × samples rays a pixel."""
    x0, y0, x1, y1 = roi
    size = ((x1 - x0) * samples, (y1 - y0) * samples)
    h, w = texture.shape[:2]
    texture_from_face = np.array(
        [
            [w / rectangle.width, 0.0, w / 2 - 0.5],
            [0.0, -h / rectangle.height, h / 2 - 0.5],
            [0.0, 0.0, 1.0],
        ]
    )
    translation, rotation = rectangle.T_camera_rectangle.as_components()
    R = rotation.as_matrix()
    pixel_from_face = camera.matrix @ np.column_stack([R[:, 0], R[:, 1], translation])
    # Sample s of a pixel lies at (s + ½) / samples - ½ from the pixel's centre.
    offset = 0.5 / samples - 0.5
    pixel_from_sample = np.array(
        [[1 / samples, 0.0, x0 + offset], [0.0, 1 / samples, y0 + offset], [0.0, 0.0, 1.0]]
    )
    texture_from_pixel = texture_from_face @ np.linalg.inv(pixel_from_face)
    opaque = np.full((h, w), 255, np.uint8)
    if camera.is_distorted:
        u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
        observed = (pixel_from_sample[:2, :2] @ np.vstack([u.ravel(), v.ravel()])).T
        ideal = camera.undistort(observed + pixel_from_sample[:2, 2])
        mapped = np.column_stack([ideal, np.ones(len(ideal))]) @ texture_from_pixel.T
        maps = (mapped[:, :2] / mapped[:, 2:]).astype(np.float32).reshape(size[1], size[0], 2)
        x, y = np.ascontiguousarray(maps[..., 0]), np.ascontiguousarray(maps[..., 1])
        color = cv2.remap(texture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        inside = cv2.remap(opaque, x, y, cv2.INTER_NEAREST)
    else:
        mapping = texture_from_pixel @ pixel_from_sample
        flags = cv2.WARP_INVERSE_MAP
        color = cv2.warpPerspective(
            texture, mapping, size, flags=flags | cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        inside = cv2.warpPerspective(opaque, mapping, size, flags=flags | cv2.INTER_NEAREST)
    color = cv2.bitwise_and(color, color, mask=inside)
    target = (x1 - x0, y1 - y0)
    mean_color = cv2.resize(color, target, interpolation=cv2.INTER_AREA)
    coverage = cv2.resize(inside, target, interpolation=cv2.INTER_AREA)
    return mean_color.astype(np.float32), coverage.astype(np.float32) / np.float32(255)


def polygon_area(corners: NDArray[np.float64]) -> float:
    """Area [px²] of a simple polygon (shoelace formula)."""
    x, y = corners[:, 0], corners[:, 1]
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
