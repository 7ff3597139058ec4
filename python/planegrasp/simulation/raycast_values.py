"""What the ray-cast camera takes and gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planegrasp.simulation.depth_sensor import KinectV1

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from planegrasp.geometry import RigidTransform
    from planegrasp.objects import PlanarFace
    from planegrasp.rgbd import RGBDFrame


@dataclass(frozen=True, slots=True)
class RaycastConfig:
    """How the camera sees.

    Attributes:
        color_noise: standard deviation of the image noise [grey levels].
        depth_sensor: its noise and range.
        light: direction towards the distant light, world frame; of any length.
        ambient: share of a surface's colour that it shows in the shade, 0 … 1; the rest grows with
            the cosine between its normal and the light.
        background_depth: distance of the wall with the background, parallel to the image [m].
        edge_samples: rays that share out a pixel at an edge.
        groups: geom groups that are seen.
    """

    color_noise: float = 3.0
    depth_sensor: KinectV1 = field(default_factory=KinectV1)
    light: tuple[float, float, float] = (-0.5, 0.3, 1.0)
    ambient: float = 0.6
    background_depth: float = 3.5
    edge_samples: int = 8
    groups: tuple[int, ...] = (0, 1, 2)


@dataclass(frozen=True, slots=True, eq=False)
class Printed:
    """A photograph on a flat side of a geom.

    Attributes:
        geom: name of the geom.
        face: the photograph and its size; its `T_object_face` is in the frame of the geom's body
            and must lie on the geom's surface.
    """

    geom: str
    face: PlanarFace


@dataclass(frozen=True, slots=True, eq=False)
class RaycastRendering:
    """A frame and what is exactly true of it.

    Attributes:
        frame: with sensor noise.
        true_depth: H×W float64 metres along the optical axis, without noise.
        geoms: H×W int32 ids of the geoms that are seen, -1 for the background.
        owners: H×W int32 indices into the camera's `printed`, -1 where none is seen.
        visible: for each printed face the share of its projected pixels, 0 … 1, that are in the
            image and not hidden; 0 where it faces away.
        corners: for each printed face its 4×2 corner pixels (as observed), None if it faces away.
        T_camera_body: for each printed face the pose of the body that carries it.
        T_world_camera: pose of the optical frame.
    """

    frame: RGBDFrame
    true_depth: NDArray[np.float64]
    geoms: NDArray[np.int32]
    owners: NDArray[np.int32]
    visible: tuple[float, ...]
    corners: tuple[NDArray[np.float64] | None, ...]
    T_camera_body: tuple[RigidTransform, ...]
    T_world_camera: RigidTransform
