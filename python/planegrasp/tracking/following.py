"""From a predicted pose to the pose that a frame shows, by the grey values of the faces.

The arithmetic is the core's (rust/core/src/tracking).
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp import _core
from planegrasp._convert import to_core_camera
from planegrasp.alignment import AlignmentConfig
from planegrasp.detection import Detection, FaceDetection
from planegrasp.errors import InvalidInputError
from planegrasp.homography import apply_homography, reference_corners
from planegrasp.pose._convert import from_core
from planegrasp.pose.fused import FusedConfig
from planegrasp.undistorted import Undistorted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

__all__ = ["FollowConfig", "Followed", "Follower"]

Followed = Detection | str
"""An object where it is seen, or in words why it is not."""


@dataclass(frozen=True, slots=True)
class FollowConfig:
    """When a face counts as seen where it was predicted.

    Attributes:
        min_tiles: fewer tiles of 8×8 pixels that agree with the reference are no evidence.
        min_share: share of the tiles in the image that agree, at least; the others may be hidden.
        min_score: mean correlation of those, at least (0 … 1).
        max_stretch: the outline may depart from that of a rigid face by this factor.
        min_side: shortest side of the outline [px], at least.
        max_view_angle: a face seen more obliquely is not looked at [rad].
        alignment: of the grey values.
        pose: settings of the pose, as in detection.

    Raises:
        InvalidInputError: a setting lies outside of its range.
    """

    min_tiles: int = 12
    min_share: float = 0.3
    min_score: float = 0.7
    max_stretch: float = 1.2
    min_side: float = 12.0
    max_view_angle: float = math.radians(82.0)
    alignment: AlignmentConfig = field(
        default_factory=lambda: AlignmentConfig(max_tiles=160, renderings=3)
    )
    pose: FusedConfig = field(default_factory=FusedConfig)

    def __post_init__(self) -> None:
        self._settings()

    def _settings(self) -> _core.FollowSettings:
        own = {name: getattr(self, name) for name in self.__slots__ if name not in _OTHER_SETTINGS}
        try:
            return _core.FollowSettings(
                **own,
                alignment=_core.AlignmentSettings(**asdict(self.alignment)),
                pose=_core.FusedSettings(**asdict(self.pose)),
            )
        except TypeError as error:
            raise InvalidInputError(f"settings of following must be numbers: {error}") from error


_OTHER_SETTINGS = ("alignment", "pose")


class Follower:
    """Looks for objects where they are predicted, several in one call.

    The faces of an object are prepared when it is followed first, and kept until `forget`.
    """

    def __init__(self, config: FollowConfig | None = None) -> None:
        self.config = config or FollowConfig()
        self._core = _core.Follower(self.config._settings())
        self._objects: dict[int, tuple[ObjectModel, _core.TrackedObject]] = {}
        self._undistorted: Undistorted | None = None
        self._camera: tuple[PinholeCamera, _core.Camera] | None = None

    def follow(
        self, predicted: Sequence[tuple[ObjectModel, int, NDArray[np.float64]]], frame: RGBDFrame
    ) -> list[Followed]:
        """Where objects are seen in a frame.

        Args:
            predicted: of each its model, its number among the instances, and its T_camera_object
                (4×4) to within some pixels.
            frame: in which to look.

        Returns:
            For each of them a detection, or in words why it is not seen there.
        """
        if not predicted:
            return []
        camera = self._core_camera(frame.camera)
        found = self._core.follow(
            [self._object(model) for model, _, _ in predicted],
            [T for _, _, T in predicted],
            self._flat(frame.color, frame.camera),
            frame.depth,
            camera,
        )
        return [
            one if isinstance(one, str) else _detection(model, instance, one, frame.camera)
            for (model, instance, _), one in zip(predicted, found, strict=True)
        ]

    def forget(self, model: ObjectModel) -> None:
        """Free what was prepared of an object."""
        self._objects.pop(id(model), None)

    def _object(self, model: ObjectModel) -> _core.TrackedObject:
        known = self._objects.get(id(model))
        if known is not None:
            return known[1]
        prepared = _core.TrackedObject()
        for face in model.faces:
            gray = cv2.cvtColor(face.image, cv2.COLOR_RGB2GRAY).astype(np.uint8)
            T_object_face = face.T_object_face.as_matrix()
            prepared.add(gray, face.face_from_edge, T_object_face, face.width, face.height)
        # The model is kept, too: its identity is the key.
        self._objects[id(model)] = model, prepared
        return prepared

    def _core_camera(self, camera: PinholeCamera) -> _core.Camera:
        if self._camera is None or self._camera[0] != camera:
            self._camera = camera, to_core_camera(camera)
        return self._camera[1]

    def _flat(self, color: NDArray[np.uint8], camera: PinholeCamera) -> NDArray[np.uint8]:
        """The grey image without lens distortion."""
        gray = cv2.cvtColor(color, cv2.COLOR_RGB2GRAY).astype(np.uint8, copy=False)
        if self._undistorted is None or self._undistorted.camera != camera:
            self._undistorted = Undistorted(camera)
        return self._undistorted.image(gray)


def _detection(
    model: ObjectModel, instance: int, followed: _core.Followed, camera: PinholeCamera
) -> Detection:
    faces = [_face(model, one, camera) for one in followed.faces]
    faces.sort(key=lambda face: -face.inliers)
    score = 1.0 - math.prod(1.0 - face.score for face in faces)
    return Detection(
        model=model,
        instance=instance,
        faces=tuple(faces),
        score=score,
        pose=from_core(followed.estimate),
        tracked=True,
    )


def _face(model: ObjectModel, seen: _core.FollowedFace, camera: PinholeCamera) -> FaceDetection:
    face = model.faces[seen.face]
    height, width = face.image.shape[:2]
    H, points = seen.homography, seen.reference_points
    return FaceDetection(
        name=face.name,
        homography=H,
        matched_homography=H,
        corners=camera.distort(apply_homography(H, reference_corners(width, height))),
        reference_points=points,
        image_points=seen.image_points,
        coverage=seen.hull_area / (width * height),
        agreement=len(points) / max(seen.compared, 1),
    )
