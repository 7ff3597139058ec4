"""Pose from reprojection and depth together. The default."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from math import radians
from typing import TYPE_CHECKING

from planegrasp import _core
from planegrasp._convert import to_core_camera
from planegrasp.errors import PoseError
from planegrasp.pose._convert import all_from_core, to_core_faces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.pose.base import FaceObservation, PoseEstimate
    from planegrasp.rgbd import RGBDFrame


@dataclass(frozen=True, slots=True, kw_only=True)
class FusedConfig:
    """Settings of the fused pose.

    The noise of depth is given in inverse depth, where that of structured light and stereo is
    uniform: σ_z = z²·σ. A Kinect v1 has 1.425e-3 1/m (Khoshelham and Elberink 2012), a stereo
    camera σ_disparity / (f·baseline).

    Attributes:
        pixel_sigma: standard deviation of an image point along one axis [px]; None estimates it
            from the residuals.
        pixel_sigma_floor: the estimate does not go below this [px].
        size_sigma: standard deviation of the relative error of the taught size (1 % = 0.01);
            0 = exact.
        ambiguity_odds: the pose is ambiguous when the other solution is at least this probable,
            relative to the best one (0 … 1).
        depth_sigma: standard deviation of a pixel's inverse depth [1/m]; None estimates it from
            the residuals of each face's plane.
        depth_sigma_floor: the estimate does not go below this [1/m].
        depth_bias_sigma: standard deviation of the relative error that all depths of a frame
            share (1 % = 0.01).
        correlation_area: pixels over which depth noise is correlated [px²]: so many count as one
            measurement.
        depth_gate: depth farther from where the image puts the face than this share of it is not
            of the face (0 … 1). Room for a biased camera and a badly measured face.
        erosion: distance that depth pixels keep from the face's outline [px].
        max_depth_pixels: about how many depth pixels of a face to use, by a regular stride.
        min_depth_pixels: fewer agreeing depth pixels of a face are not used.
        max_view_angle: a face seen more obliquely contributes no depth [rad].

    Raises:
        InvalidInputError: a setting lies outside of its range.
    """

    pixel_sigma: float | None = None
    pixel_sigma_floor: float = 0.1
    size_sigma: float = 0.015
    ambiguity_odds: float = 0.01
    depth_sigma: float | None = None
    depth_sigma_floor: float = 2e-4
    depth_bias_sigma: float = 0.01
    correlation_area: float = 4.0
    depth_gate: float = 0.15
    erosion: float = 3.0
    max_depth_pixels: int = 4000
    min_depth_pixels: int = 30
    max_view_angle: float = radians(80.0)

    def __post_init__(self) -> None:
        self._settings()

    def _settings(self) -> _core.FusedSettings:
        # Every frame: `asdict` would copy deeply.
        return _core.FusedSettings(**{one.name: getattr(self, one.name) for one in fields(self)})


@dataclass(frozen=True, slots=True)
class FusedEstimator:
    """Poses from the inliers' reprojection and the plane that each face's depth pixels show.

    Robust against something that covers part of the face, also with its own depth. Without usable
    depth the estimate is that of `PnPEstimator`.
    """

    config: FusedConfig = field(default_factory=FusedConfig)

    @property
    def name(self) -> str:
        """As in `DetectorConfig.pose`."""
        return "fused"

    def estimate(self, faces: Sequence[FaceObservation], frame: RGBDFrame) -> PoseEstimate:
        """Pose of the object from all its faces.

        Raises:
            PoseError: too few inliers, inliers on a line, or a homography that shows the face
                from behind.
            InvalidInputError: no face was given, or one with arrays that cannot be worked with.
        """
        (result,) = self.estimate_all([faces], frame)
        if isinstance(result, PoseError):
            raise result
        return result

    def estimate_all(
        self, objects: Sequence[Sequence[FaceObservation]], frame: RGBDFrame
    ) -> list[PoseEstimate | PoseError]:
        """See `PoseEstimator.estimate_all`; all in one call of the core, on all its threads."""
        results: dict[int, PoseEstimate | PoseError] = {}
        faces: dict[int, list[_core.Face]] = {}
        for number, observations in enumerate(objects):
            try:
                faces[number] = to_core_faces(observations)
            except PoseError as error:
                results[number] = error
        camera = to_core_camera(frame.camera)
        estimates = _core.fused(list(faces.values()), camera, frame.depth, self.config._settings())
        by_number = dict(zip(faces, estimates, strict=True))
        good = {n: one for n, one in by_number.items() if not isinstance(one, PoseError)}
        results |= {n: one for n, one in by_number.items() if isinstance(one, PoseError)}
        results |= zip(good, all_from_core(list(good.values())), strict=True)
        return [results[number] for number in range(len(objects))]
