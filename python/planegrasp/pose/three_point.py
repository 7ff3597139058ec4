"""The paper's pose: three depth look-ups (eq. 3-5). The baseline."""

from __future__ import annotations

from dataclasses import dataclass
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


@dataclass(frozen=True, slots=True)
class ThreePointEstimator:
    """Looks the face's centre, right-edge and top-edge midpoints up in the depth image.

    Only the first face counts. There is no pose when one of the three points has no depth or lies
    outside of the image; there is no covariance and no warning when a depth is wrong.
    """

    @property
    def name(self) -> str:
        """As in `DetectorConfig.pose`."""
        return "three_point"

    def estimate(self, faces: Sequence[FaceObservation], frame: RGBDFrame) -> PoseEstimate:
        """Pose of the object from its first face.

        Raises:
            PoseError: the frame has no depth, or not at one of the points, which is named.
            InvalidInputError: no face was given, or one with arrays that cannot be worked with.
        """
        camera = to_core_camera(frame.camera)
        return from_core(_core.three_point(to_core_faces(faces[:1]), camera, frame.depth))

    def estimate_all(
        self, objects: Sequence[Sequence[FaceObservation]], frame: RGBDFrame
    ) -> list[PoseEstimate | PoseError]:
        """See `PoseEstimator.estimate_all`."""
        return one_by_one(self, objects, frame)
