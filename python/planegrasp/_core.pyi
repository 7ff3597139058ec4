"""The compiled arithmetic. Arrays are float64 and C-contiguous unless said otherwise.

Functions raise `planegrasp.errors.InvalidInputError` for arguments that cannot be worked with and
`planegrasp.errors.PoseError` where there is no pose, and release the interpreter's lock.
"""

from collections.abc import Sequence
from typing import TypedDict, final

import numpy as np
from numpy.typing import NDArray

__version__: str

@final
class Camera:
    """Intrinsics [px]; `distortion` is (k1, k2, p1, p2, k3)."""

    def __new__(
        cls,
        width: int,
        height: int,
        fx: float,
        fy: float,
        cx: float,
        cy: float,
        distortion: Sequence[float],
    ) -> Camera: ...

@final
class Face:
    """The evidence for one face, as in `planegrasp.pose.FaceObservation`."""

    def __new__(
        cls,
        T_object_face: NDArray[np.float64],
        width: float,
        height: float,
        face_points: NDArray[np.float64],
        image_points: NDArray[np.float64],
        homography: NDArray[np.float64],
    ) -> Face: ...

@final
class Estimate:
    """A pose with its quality, as in `planegrasp.pose.PoseEstimate`; transforms are 4×4."""

    @property
    def T_camera_object(self) -> NDArray[np.float64]: ...
    @property
    def covariance(self) -> NDArray[np.float64] | None: ...
    @property
    def ambiguous(self) -> bool: ...
    @property
    def alternative(self) -> NDArray[np.float64] | None: ...
    @property
    def reprojection_rms(self) -> float: ...
    @property
    def depth_pixels(self) -> int: ...

@final
class PnPSettings:
    """Checked settings of `pnp`, as in `planegrasp.pose.PnPConfig`."""

    def __new__(
        cls,
        *,
        pixel_sigma: float | None,
        pixel_sigma_floor: float,
        size_sigma: float,
        ambiguity_odds: float,
    ) -> PnPSettings: ...
    @staticmethod
    def defaults() -> dict[str, float | None]: ...

@final
class FusedSettings:
    """Checked settings of `fused`, as in `planegrasp.pose.FusedConfig`."""

    def __new__(
        cls,
        *,
        pixel_sigma: float | None,
        pixel_sigma_floor: float,
        size_sigma: float,
        ambiguity_odds: float,
        depth_sigma: float | None,
        depth_sigma_floor: float,
        depth_bias_sigma: float,
        correlation_area: float,
        depth_gate: float,
        erosion: float,
        max_depth_pixels: int,
        min_depth_pixels: int,
        max_view_angle: float,
    ) -> FusedSettings: ...
    @staticmethod
    def defaults() -> dict[str, float | None]: ...

def three_point(
    faces: Sequence[Face], camera: Camera, depth: NDArray[np.float32] | None
) -> Estimate:
    """Pose of the first face from three depth look-ups; `depth` is H×W float32 metres."""

def pnp(faces: Sequence[Face], camera: Camera, settings: PnPSettings) -> Estimate:
    """Pose from the correspondences of all faces."""

def fused(
    faces: Sequence[Face],
    camera: Camera,
    depth: NDArray[np.float32] | None,
    settings: FusedSettings,
) -> Estimate:
    """Pose from the correspondences and the depth (H×W float32 metres) of all faces."""

def planar_poses(face: Face, camera: Camera) -> list[NDArray[np.float64]]:
    """Both planar solutions T_camera_face (4×4) before refinement, the better one first."""

def fit_plane(
    rays: NDArray[np.float64], inverse_depth: NDArray[np.float64]
) -> tuple[tuple[float, float, float], float] | None:
    """Robust plane (a, b, c), 1/z = (a, b, c) · ray, and its residuals' standard deviation [1/m].

    Least median of squares, then Tukey's biweight: up to half of the pixels may show something
    else.

    Args:
        rays: N×3, viewing rays with z = 1.
        inverse_depth: N, [1/m].

    Returns:
        The plane and the deviation, or None where the pixels span no plane.

    Raises:
        InvalidInputError: for other shapes.
    """

def estimate_homography(
    source: NDArray[np.float64],
    target: NDArray[np.float64],
    *,
    threshold: float,
    max_iterations: int,
    seed: int = 0,
) -> tuple[NDArray[np.float64], int] | None:
    """Homography (3×3, source to target) that most matches agree with, and how many do.

    Args:
        source: N×2, the likeliest matches first: they are sampled first.
        target: N×2.
        threshold: largest distance from where the homography puts a point [target unit].
        max_iterations: of the random sampling.
        seed: of the random sampling.

    Returns:
        The homography and the number of inliers, or None where no four matches give one.

    Raises:
        InvalidInputError: for other shapes, values that are not finite, or a threshold ≤ 0.
    """

def refine_homography(
    source: NDArray[np.float64],
    target: NDArray[np.float64],
    start: NDArray[np.float64],
    scale: float,
) -> NDArray[np.float64] | None:
    """A homography refined on all matches (N×2 each) under Cauchy's loss of this scale.

    Returns:
        3×3, or None where the matches determine none.

    Raises:
        InvalidInputError: for other shapes, or a scale ≤ 0.
    """

class SiftSettings(TypedDict):
    """Settings of `Sift` by name."""

    max_features: int
    octave_layers: int
    contrast_threshold: float
    edge_threshold: float
    sigma: float
    double_first_octave: bool

@final
class Sift:
    """Extractor behind `planegrasp.features.SIFT`; `threads` = 0 takes all of the machine."""

    def __new__(
        cls,
        *,
        max_features: int,
        octave_layers: int,
        contrast_threshold: float,
        edge_threshold: float,
        sigma: float,
        double_first_octave: bool,
        threads: int,
    ) -> Sift: ...
    @staticmethod
    def defaults() -> SiftSettings: ...
    def extract(
        self, image: NDArray[np.uint8]
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.uint8],
    ]:
        """Points N×2, scales, angles, responses and descriptors N×128 of an H×W image."""
