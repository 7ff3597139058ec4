"""Lens models of other kinds in OpenCV's coefficients."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


def brown_conrady(
    camera_size: tuple[int, int],
    principal_point: tuple[float, float],
    focal_lengths: tuple[float, float],
    deproject: Callable[[tuple[float, float]], Sequence[float]],
) -> tuple[tuple[float, ...], float]:
    """Fit OpenCV's (k1, k2, p1, p2, k3) to any lens model.

    Args:
        camera_size: width and height of the image [px].
        principal_point: cx, cy [px].
        focal_lengths: fx, fy [px].
        deproject: gives for a pixel (u, v) the point (x, y) at depth 1 that is seen there.

    Returns:
        The coefficients, and the largest error of the fit in the image [px].
    """
    width, height = camera_size
    pixels = [
        (float(u), float(v))
        for u in np.linspace(0, width - 1, 15)
        for v in np.linspace(0, height - 1, 11)
    ]
    focal = np.asarray(focal_lengths)
    x, y = np.array([deproject(pixel)[:2] for pixel in pixels]).T
    seen = (np.array(pixels) - principal_point) / focal
    # The model is linear in its coefficients: seen - (x, y) = A · (k1, k2, p1, p2, k3).
    r2 = x**2 + y**2
    xy = 2 * x * y
    of_x = np.stack([x * r2, x * r2**2, xy, r2 + 2 * x**2, x * r2**3], axis=1)
    of_y = np.stack([y * r2, y * r2**2, r2 + 2 * y**2, xy, y * r2**3], axis=1)
    A = np.stack([of_x, of_y], axis=1)
    b = seen - np.stack([x, y], axis=1)
    coefficients = np.linalg.lstsq(A.reshape(-1, 5), b.reshape(-1), rcond=None)[0]
    error = np.abs(A @ coefficients - b) * focal
    return tuple(coefficients.tolist()), float(error.max())
