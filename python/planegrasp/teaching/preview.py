"""A picture of a face with its features, to see what it will be recognised by."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.geometry import edge_from_pixel, pixel_from_edge
from planegrasp.rgbd import check_color
from planegrasp.teaching.trial import run_trial

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.features.base import Extractor

__all__ = ["draw_preview"]

_SHORTEST_SIDE = 400
_RECOGNISED = (60, 220, 60)
_OTHER = (230, 120, 40)


def draw_preview(
    face_image: NDArray[np.uint8], extractor: Extractor | None = None
) -> NDArray[np.uint8]:
    """Draw features as circles of their size: green those that are recognised in a second view.

    Args:
        face_image: H×W×3 uint8 RGB.
        extractor: of the features; None is SIFT.

    Returns:
        The face, at least 400 pixels high and wide, h×w×3 uint8 RGB.
    """
    if extractor is None:
        from planegrasp.features import make_extractor

        extractor = make_extractor("sift")
    image = check_color(face_image)
    trial = run_trial(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY).astype(np.uint8), extractor)
    zoom = max(1, int(np.ceil(_SHORTEST_SIDE / min(image.shape[:2]))))
    canvas = np.repeat(np.repeat(image, zoom, axis=0), zoom, axis=1)
    factor = zoom / trial.scale
    centres = pixel_from_edge(edge_from_pixel(trial.features.points) * factor)
    recognised = np.zeros(len(centres), bool)
    recognised[trial.recognised] = True
    # The recognised last, so that they lie on top.
    for i in np.argsort(recognised, kind="stable"):
        x, y = np.rint(centres[i]).astype(int)
        radius = max(2, round(float(trial.features.scales[i]) * factor / 2))
        color = _RECOGNISED if recognised[i] else _OTHER
        cv2.circle(canvas, (int(x), int(y)), radius, color, 1, cv2.LINE_AA)
    return np.ascontiguousarray(canvas)
