"""Pose without depth: both planar solutions, refined on all faces."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

from planegrasp import _core
from planegrasp._convert import to_core_camera
from planegrasp.pose._convert import from_core, to_core_faces
from planegrasp.pose.base import one_by_one

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.errors import PoseError
    from planegrasp.pose.base import FaceObservation, PoseEstimate
    from planegrasp.rgbd import RGBDFrame


@dataclass(frozen=True, slots=True, kw_only=True)
class PnPConfig:
    """Settings of the pose without depth.

    Attributes:
        pixel_sigma: standard deviation of an image point along one axis [px]; None estimates it
            from the residuals.
        pixel_sigma_floor: the estimate does not go below this [px].
        size_sigma: standard deviation of the relative error of the taught size (1 % = 0.01);
            0 = exact.
        ambiguity_odds: the pose is ambiguous when the other planar solution is at least this
            probable, relative to the best one (0 … 1).

    Raises:
        InvalidInputError: a setting lies outside of its range.
    """

    pixel_sigma: float | None = None
    pixel_sigma_floor: float = 0.1
    size_sigma: float = 0.015
    ambiguity_odds: float = 0.01

    def __post_init__(self) -> None:
        self._settings()

    def _settings(self) -> _core.PnPSettings:
        return _core.PnPSettings(**asdict(self))


@dataclass(frozen=True, slots=True)
class PnPEstimator:
    """Poses from the reprojection of the inliers alone.

    Both planar solutions of the best face (IPPE) are refined on the inliers of all faces. When
    they explain the image about equally well the estimate is `ambiguous` and carries both.
    """

    config: PnPConfig = field(default_factory=PnPConfig)

    @property
    def name(self) -> str:
        """As in `DetectorConfig.pose`."""
        return "pnp"

    def estimate(self, faces: Sequence[FaceObservation], frame: RGBDFrame) -> PoseEstimate:
        """Pose of the object from all its faces.

        Raises:
            PoseError: too few inliers, inliers on a line, or a homography that shows the face
                from behind.
            InvalidInputError: no face was given, or one with arrays that cannot be worked with.
        """
        camera = to_core_camera(frame.camera)
        return from_core(_core.pnp(to_core_faces(faces), camera, self.config._settings()))

    def estimate_all(
        self, objects: Sequence[Sequence[FaceObservation]], frame: RGBDFrame
    ) -> list[PoseEstimate | PoseError]:
        """See `PoseEstimator.estimate_all`."""
        return one_by_one(self, objects, frame)
