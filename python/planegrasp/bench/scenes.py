"""Random views of flat objects, as docs/benchmarks.md defines them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.textures import random_background, texture
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.objects import ObjectModel
from planegrasp.simulation import Rectangle, render

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.simulation import Rendering

CAMERA = PinholeCamera(width=640, height=480, fx=525.0, fy=525.0, cx=319.5, cy=239.5)
FACE_WIDTH = 0.25
DISTANCE = 0.7

# An upright face seen straight on: its x right, y up, z towards the camera.
FRONTAL = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))


def photograph(name: str, width: float = FACE_WIDTH) -> ObjectModel:
    """One of the photographs as a one-face object of this width [m]."""
    return ObjectModel.from_image(name, texture(name), width)


def random_pose(
    rng: np.random.Generator,
    tilt: float,
    distance: float = DISTANCE,
    offset: tuple[float, float] = (0.08, 0.06),
) -> RigidTransform:
    """A pose whose normal is `tilt` radians off the line of sight, about any axis, at any roll.

    Args:
        rng: draws the axis, the roll and the position.
        tilt: out-of-plane rotation [rad].
        distance: along the optical axis [m].
        offset: the centre lies within ± this of the optical axis, in x and y [m].
    """
    axis = rng.uniform(0.0, 2.0 * np.pi)
    roll = rng.uniform(0.0, 2.0 * np.pi)
    position = np.array(
        [rng.uniform(-offset[0], offset[0]), rng.uniform(-offset[1], offset[1]), distance]
    )
    return facing_pose(position, tilt, axis, roll)


def facing_pose(
    position: NDArray[np.float64], tilt: float, axis: float, roll: float
) -> RigidTransform:
    """The pose at a position whose normal is `tilt` off the line of sight to it [rad]."""
    sight = position / np.linalg.norm(position)
    to_sight, _ = Rotation.align_vectors(sight[None], np.array([[0.0, 0.0, 1.0]]))
    out_of_plane = Rotation.from_rotvec(tilt * np.array([np.cos(axis), np.sin(axis), 0.0]))
    in_plane = Rotation.from_rotvec([0.0, 0.0, roll])
    return RigidTransform.from_components(position, to_sight * out_of_plane * in_plane * FRONTAL)


def rectangles(model: ObjectModel, T_camera_object: RigidTransform) -> list[Rectangle]:
    """The faces of an object at a pose."""
    return [
        Rectangle(f.image, f.width, f.height, T_camera_object * f.T_object_face)
        for f in model.faces
    ]


def view(
    model: ObjectModel,
    rng: np.random.Generator,
    tilt: float,
    distance: float = DISTANCE,
    others: Sequence[Rectangle] = (),
) -> tuple[RigidTransform, Rendering]:
    """A random view of a one-face object; its rectangle is the first of the rendering."""
    T_camera_object = random_pose(rng, tilt, distance)
    scene = [*rectangles(model, T_camera_object), *others]
    return T_camera_object, render(scene, CAMERA, rng, background=random_background(rng))


def corner_error(found: NDArray[np.float64], true: NDArray[np.float64]) -> float:
    """Mean distance of the four corners [px]."""
    return float(np.linalg.norm(found - true, axis=1).mean())


# A detection succeeds if its mean corner error is below this [px].
CORNER_TOLERANCE = 5.0
