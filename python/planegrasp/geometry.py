"""Camera model, rigid transforms and the paper's Euler angles.

Frames and units are those of docs/conventions.md: metres and radians; the camera's optical frame
has x right, y down, z forward; pixel centres lie at integer coordinates; ``T_a_b`` maps points of
frame b into frame a. Rigid transforms are SciPy's :class:`RigidTransform`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from planegrasp.errors import CameraError, InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    Float64Array = NDArray[np.float64]

__all__ = [
    "PinholeCamera",
    "RigidTransform",
    "Rotation",
    "checked_transform",
    "edge_from_pixel",
    "euler_from_rotation",
    "pixel_from_edge",
    "rigid_transform",
    "rotation_angle",
    "rotation_from_euler",
    "transform_from_quaternion",
]

# OpenCV's own default of 5 iterations leaves hundredths of a pixel. Most points need fewer than 20;
# the corners of a wide-angle image, where the fixed point is approached slowly, some hundreds.
_UNDISTORT_CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 1000, 1e-12)


@dataclass(frozen=True, slots=True)
class PinholeCamera:
    """Intrinsics of a camera in OpenCV's model.

    Attributes:
        width: image width [px].
        height: image height [px].
        fx: focal length along x [px].
        fy: focal length along y [px].
        cx: principal point x [px], pixel centres at integer coordinates.
        cy: principal point y [px].
        distortion: ``()`` or up to five coefficients (k1, k2, p1, p2, k3).

    Raises:
        CameraError: for sizes or focal lengths that are not positive and finite, a principal
            point more than one image size outside of the image, or too many coefficients.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "distortion", tuple(float(k) for k in self.distortion))
        if self.width < 1 or self.height < 1:
            raise CameraError(f"image size must be positive, got {self.width}×{self.height}")
        values = (self.fx, self.fy, self.cx, self.cy, *self.distortion)
        if not np.all(np.isfinite(values)):
            raise CameraError(f"camera parameters must be finite, got {values}")
        if self.fx <= 0 or self.fy <= 0:
            raise CameraError(f"focal lengths must be > 0 px, got fx={self.fx}, fy={self.fy}")
        if not (-self.width <= self.cx <= 2 * self.width) or not (
            -self.height <= self.cy <= 2 * self.height
        ):
            raise CameraError(
                f"principal point ({self.cx}, {self.cy}) lies far outside of the "
                f"{self.width}×{self.height} image: is it in pixels?"
            )
        if len(self.distortion) > 5:
            raise CameraError(
                f"distortion takes up to 5 coefficients (k1, k2, p1, p2, k3), "
                f"got {len(self.distortion)}"
            )

    @property
    def matrix(self) -> Float64Array:
        """The 3×3 intrinsic matrix K."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def coefficients(self) -> Float64Array:
        """The five distortion coefficients (k1, k2, p1, p2, k3), zeros where not given."""
        padded = np.zeros(5)
        padded[: len(self.distortion)] = self.distortion
        return padded

    @property
    def is_distorted(self) -> bool:
        """Whether any distortion coefficient is not zero."""
        return any(k != 0.0 for k in self.distortion)

    def undistort(self, pixels: ArrayLike) -> Float64Array:
        """Move observed pixels (N×2) to where a camera with this K and no distortion sees them.

        A pixel that the lens model cannot reach (strong coefficients turn it back before the
        image's corner) has no such place; it goes to a nearby one.
        """
        points = _points(pixels, 2)
        if not self.is_distorted or not len(points):
            return points
        undistorted = cv2.undistortPoints(
            points.reshape(-1, 1, 2),
            self.matrix,
            self.coefficients,
            R=np.eye(3),
            P=self.matrix,
            criteria=_UNDISTORT_CRITERIA,
        )
        return np.asarray(undistorted, dtype=np.float64).reshape(-1, 2)

    def distort(self, pixels: ArrayLike) -> Float64Array:
        """Move undistorted pixels (N×2) to where the lens puts them: inverse of `undistort`."""
        points = _points(pixels, 2)
        if not self.is_distorted or not len(points):
            return points
        x = (points[:, 0] - self.cx) / self.fx
        y = (points[:, 1] - self.cy) / self.fy
        return self.project(np.column_stack([x, y, np.ones_like(x)]))

    def rays(self, pixels: ArrayLike) -> Float64Array:
        """Viewing rays (N×3, z = 1, camera frame) of observed pixels (N×2)."""
        points = self.undistort(pixels)
        x = (points[:, 0] - self.cx) / self.fx
        y = (points[:, 1] - self.cy) / self.fy
        return np.column_stack([x, y, np.ones_like(x)])

    def project(self, points: ArrayLike) -> Float64Array:
        """Project points (N×3, camera frame, metres, z > 0) to observed pixels (N×2)."""
        xyz = _points(points, 3)
        if np.any(xyz[:, 2] <= 0):
            raise InvalidInputError(
                f"only points in front of the camera (z > 0) project, got z = {xyz[:, 2].min():.6g}"
            )
        x, y = xyz[:, 0] / xyz[:, 2], xyz[:, 1] / xyz[:, 2]
        k1, k2, p1, p2, k3 = self.coefficients
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        x_d = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        y_d = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return np.column_stack([self.fx * x_d + self.cx, self.fy * y_d + self.cy])


def edge_from_pixel(points: ArrayLike) -> Float64Array:
    """Move points from pixel coordinates (centres at integers) to edge coordinates."""
    return np.asarray(points, dtype=np.float64) + 0.5


def pixel_from_edge(points: ArrayLike) -> Float64Array:
    """Move points from edge coordinates to pixel coordinates (centres at integers)."""
    return np.asarray(points, dtype=np.float64) - 0.5


def rigid_transform(matrix: ArrayLike, *, tolerance: float = 1e-4) -> RigidTransform:
    """Make a RigidTransform of a 4×4 matrix, refusing what is not one.

    Args:
        matrix: 4×4 homogeneous matrix with a rotation in its upper left.
        tolerance: largest accepted deviation of R·Rᵀ from the identity.

    Raises:
        InvalidInputError: for another shape, values that are not finite, a last row other than
            (0, 0, 0, 1), or an upper left 3×3 that is not a right-handed rotation.
    """
    T = np.asarray(matrix, dtype=np.float64)
    if T.shape != (4, 4):
        raise InvalidInputError(f"a rigid transform is a 4×4 matrix, got shape {T.shape}")
    if not np.all(np.isfinite(T)):
        raise InvalidInputError("a rigid transform must have finite values")
    if not np.allclose(T[3], (0.0, 0.0, 0.0, 1.0), atol=tolerance):
        raise InvalidInputError(f"the last row must be (0, 0, 0, 1), got {T[3].tolist()}")
    R = T[:3, :3]
    deviation = float(np.abs(R @ R.T - np.eye(3)).max())
    if deviation > tolerance:
        raise InvalidInputError(
            f"the upper left 3×3 must be a rotation: R·Rᵀ deviates from the identity by "
            f"{deviation:.3g} (at most {tolerance:.3g})"
        )
    if np.linalg.det(R) < 0:
        raise InvalidInputError("the upper left 3×3 mirrors (determinant -1): axes are swapped")
    return RigidTransform.from_components(T[:3, 3], Rotation.from_matrix(R))


def checked_transform(value: RigidTransform | ArrayLike, what: str) -> RigidTransform:
    """The same transform, or that of a 4×4 matrix; what is not rigid and finite is refused.

    Args:
        value: to check.
        what: how the error calls it.

    Raises:
        InvalidInputError: see `rigid_transform`.
    """
    if isinstance(value, RigidTransform):
        value = value.as_matrix()
    try:
        return rigid_transform(value)
    except InvalidInputError as error:
        raise InvalidInputError(f"{what}: {error}") from error


def transform_from_quaternion(translation: ArrayLike, quaternion: ArrayLike) -> RigidTransform:
    """Make a RigidTransform of a translation [m] and a quaternion (x, y, z, w).

    Raises:
        InvalidInputError: the quaternion's length is not 1 (to a thousandth, and is made so).
    """
    components = np.asarray(quaternion, dtype=np.float64)
    length = float(np.linalg.norm(components))
    if not abs(length - 1.0) <= 1e-3:
        raise InvalidInputError(
            f"quaternion {components.tolist()} has length {length:.4g}, a rotation has 1"
        )
    place = np.asarray(translation, dtype=np.float64)
    return RigidTransform.from_components(place, Rotation.from_quat(components))


def rotation_angle(a: Rotation, b: Rotation) -> float:
    """Angle of the rotation between two orientations [rad], 0 … π."""
    return float((a.inv() * b).magnitude())


def euler_from_rotation(rotation: Rotation) -> tuple[float, float, float]:
    """Roll, pitch and yaw (φ, θ, ψ) with R = Rz(ψ)·Ry(θ)·Rx(φ) (paper, eq. 6-8).

    The paper's arctangents of a ratio lose the quadrant; atan2 keeps it. At θ = ±90° only φ ∓ ψ is
    defined: then φ = 0 is returned and ψ carries the whole remaining rotation.

    Returns:
        (φ, θ, ψ) in radians: φ and ψ in (-π, π], θ in [-π/2, π/2].
    """
    R = rotation.as_matrix()
    cos_pitch = float(np.hypot(R[2, 1], R[2, 2]))
    theta = float(np.arctan2(-R[2, 0], cos_pitch))
    if cos_pitch < 1e-9:
        return 0.0, theta, float(np.arctan2(-R[0, 1], R[1, 1]))
    return float(np.arctan2(R[2, 1], R[2, 2])), theta, float(np.arctan2(R[1, 0], R[0, 0]))


def rotation_from_euler(phi: float, theta: float, psi: float) -> Rotation:
    """Rotation Rz(ψ)·Ry(θ)·Rx(φ) of roll φ, pitch θ, yaw ψ [rad] (paper, eq. 6)."""
    return Rotation.from_euler("ZYX", (psi, theta, phi))


def _points(points: ArrayLike | Sequence[Sequence[float]], dimension: int) -> Float64Array:
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != dimension:
        raise InvalidInputError(f"expected an N×{dimension} array, got shape {array.shape}")
    return array
