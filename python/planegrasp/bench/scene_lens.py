"""The lens of a recording's camera, from everything in view that stands still.

Camera files often have no lens distortion because nobody measured it: many drivers report zeros.
But it shifts what is seen near the border of the image against what is seen in its middle, and so
turns a face whose sides are compared. Landmarks that are seen again elsewhere in the image show it:
the distortion is right with which one rigid motion a frame reprojects them best.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize

from planegrasp.bench.scene_motion import Sightings, camera_motion, reproject

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.bench.scene_motion import Landmarks
    from planegrasp.geometry import PinholeCamera

__all__ = ["calibrate_lens"]

# Frames that the distortion is judged by, spread over the recording.
_FRAMES = 16
# Only landmarks this near to where the undistorted camera expects them take part …
_GATE_PX = 8.0
# … and the pose is fitted to those that agree with it this well.
_INLIER_PX = 3.0
# Scale of Cauchy's loss: about the noise of a feature between frames.
_NOISE_PX = 0.7
# First steps of k1 and k2, and what is precise enough: 1e-3 moves a corner of the image by 0.1 px.
_STEPS = (0.05, 0.1)
_TOLERANCE = 1e-3
# No lens of a depth camera bends more.
_LARGEST = 1.0
_FEWEST = 6


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """What one frame sees of the landmarks, and about where its camera is."""

    sighted: Sightings
    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]


def calibrate_lens(
    seen: Landmarks, sighted: Sequence[Sightings], camera: PinholeCamera
) -> PinholeCamera:
    """The camera with radial distortion k1, k2, where its own has none and the scene shows one.

    Focal lengths and principal point stay: small motions cannot tell them from the distances.

    Args:
        seen: landmarks of the first frame.
        sighted: in other frames.
        camera: a camera with distortion is taken to be calibrated, and returned as it is.
    """
    if camera.is_distorted:
        return camera
    chosen = sighted[:: max(1, len(sighted) // _FRAMES)]
    views = [view for one in chosen if (view := _view(seen, one, camera)) is not None]
    if not views:
        return camera

    def cost(radial: NDArray[np.float64]) -> float:
        if np.abs(radial).max() > _LARGEST:
            return np.inf
        distorted = replace(camera, distortion=tuple(radial.tolist()))
        return float(np.concatenate([_losses(seen, view, distorted) for view in views]).mean())

    start = np.zeros(2)
    best = minimize(
        cost,
        start,
        method="Nelder-Mead",
        options={
            "initial_simplex": np.vstack([start, np.diag(_STEPS)]),
            "xatol": _TOLERANCE,
            "fatol": 1e-6,
        },
    )
    return replace(camera, distortion=tuple(best.x.tolist()))


def _view(seen: Landmarks, sighted: Sightings, camera: PinholeCamera) -> _View | None:
    motion = camera_motion(seen, sighted, camera)
    if motion is None:
        return None
    expected = camera.project(motion.apply(seen.points(camera)[sighted.index]))
    near = np.linalg.norm(expected - sighted.pixels, axis=1) < _GATE_PX
    return _View(
        Sightings(sighted.index[near], sighted.pixels[near]),
        motion.rotation.as_rotvec(),
        motion.translation,
    )


def _losses(seen: Landmarks, view: _View, camera: PinholeCamera) -> NDArray[np.float64]:
    """Loss of each sighting at the pose that reprojects them best."""
    points = seen.points(camera)[view.sighted.index]
    image = camera.undistort(view.sighted.pixels)
    everything = np.ones(len(points), bool)
    pose = (view.rotation, view.translation)
    pose, errors = reproject(points, image, camera, everything, pose)
    agreeing = errors < _INLIER_PX
    if np.count_nonzero(agreeing) >= _FEWEST:
        _, errors = reproject(points, image, camera, agreeing, pose)
    return np.asarray(np.log1p((errors / _NOISE_PX) ** 2), dtype=np.float64)
