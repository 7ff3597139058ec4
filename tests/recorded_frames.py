"""Small frames with timestamps, and comparing what was read back with them."""

from __future__ import annotations

import numpy as np

from planegrasp.geometry import PinholeCamera
from planegrasp.rgbd import RGBDFrame

WIDTH, HEIGHT = 8, 6
CAMERA = PinholeCamera(WIDTH, HEIGHT, 10.0, 11.0, 3.5, 2.25, (0.01, -0.02, 0.001, 0.002, 0.003))
START = 1_700_000_000.25


def frame(number, *, depth=True, size=(WIDTH, HEIGHT), unit=0.001, camera=None, stamp=None):
    """A frame of noise; depth in whole units [m], with some pixels without a measurement."""
    rng = np.random.default_rng(number)
    width, height = size
    color = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
    metres = None
    if depth:
        metres = (rng.integers(400, 3000, (height, width)) * unit).astype(np.float32)
        metres[0, :3] = 0
    if camera is None:
        camera = CAMERA
        if size != (WIDTH, HEIGHT):
            camera = PinholeCamera(width, height, 20.0, 20.0, width / 2, height / 2)
    stamp = START + number / 30 if stamp is None else stamp
    return RGBDFrame(color, metres, camera, f"{number:06d}", stamp)


def assert_same(read, written, depth_error=1e-6):
    """Frames are equal, but for the rounding of their timestamps [s] and depths [m]."""
    assert len(read) == len(written)
    for a, b in zip(read, written, strict=True):
        assert a.name == b.name
        np.testing.assert_array_equal(a.color, b.color)
        assert (a.depth is None) == (b.depth is None)
        if a.depth is not None:
            np.testing.assert_allclose(a.depth, b.depth, atol=depth_error, rtol=0)
            np.testing.assert_array_equal(a.depth == 0, b.depth == 0)
        assert abs(a.timestamp - b.timestamp) < 2e-6
        assert (a.camera.width, a.camera.height) == (b.camera.width, b.camera.height)
        np.testing.assert_allclose(a.camera.matrix, b.camera.matrix)
        np.testing.assert_allclose(a.camera.coefficients, b.camera.coefficients)
