"""Something in front of a face."""

from __future__ import annotations

import numpy as np

from planegrasp.bench.textures import random_background
from planegrasp.geometry import RigidTransform
from planegrasp.simulation import Rectangle


def occluder(
    face: Rectangle,
    share: float,
    rng: np.random.Generator,
    gap: tuple[float, float] = (0.03, 0.3),
) -> Rectangle:
    """A textured rectangle, nearer than the face, that hides this share of it from one side.

    A strip along one side of the face is moved towards the camera's centre: it keeps its outline
    in the image, gets depth of its own, and overhangs the face on the other three sides.

    Args:
        face: what is partly hidden.
        share: of its area, 0 … 1.
        rng: draws the side, the gap and the texture.
        gap: range of the distance between the two [m].
    """
    overhang = 0.2 * max(face.width, face.height)
    distance = float(np.linalg.norm(face.T_camera_rectangle.translation))
    nearer = 1.0 - rng.uniform(*gap) / distance
    side = int(rng.integers(4))
    across = face.width if side < 2 else face.height
    sign = 1.0 if side % 2 else -1.0
    # From `inner` to beyond the face's edge, along the axis that the side is on.
    inner, outer = across / 2 - share * across, across / 2 + overhang
    along = (face.height if side < 2 else face.width) + 2 * overhang
    centre = sign * (inner + outer) / 2
    position = [centre, 0.0, 0.0] if side < 2 else [0.0, centre, 0.0]
    size = (outer - inner, along) if side < 2 else (along, outer - inner)
    T = face.T_camera_rectangle * RigidTransform.from_translation(position)
    translation, rotation = T.as_components()
    return Rectangle(
        np.ascontiguousarray(random_background(rng)),
        nearer * size[0],
        nearer * size[1],
        RigidTransform.from_components(nearer * translation, rotation),
    )
