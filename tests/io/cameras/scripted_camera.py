"""A camera whose frames and losses are written down beforehand."""

from __future__ import annotations

from queue import SimpleQueue

import numpy as np

from planegrasp.errors import CameraLostError
from planegrasp.geometry import PinholeCamera
from planegrasp.rgbd import RGBDFrame


def frame(number=0, stamp=None, size=(8, 6), depth=True):
    """A small frame that shows its number."""
    width, height = size
    color = np.full((height, width, 3), number % 256, np.uint8)
    metres = np.full((height, width), 1.0, np.float32) if depth else None
    camera = PinholeCamera(width, height, 10.0, 10.0, (width - 1) / 2, (height - 1) / 2)
    return RGBDFrame(color, metres, camera, str(number), stamp)


class ScriptedCamera:
    """Gives what is put into it: a frame, or an error that it raises.

    A loss keeps it from being opened until `plug_in` was called as often as `unplug`.
    """

    name = "scripted"
    notes = ()

    def __init__(self, *script, timeout=5.0):
        self.opened = 0
        self.closed = 0
        self.failed_openings = 0
        self.plugged = True
        self._timeout = timeout
        self._open = False
        self._script = SimpleQueue()
        self.give(*script)

    def give(self, *script):
        for step in script:
            self._script.put(step)

    def open(self):
        if not self.plugged:
            self.failed_openings += 1
            raise CameraLostError("scripted is not there")
        if not self._open:
            self.opened += 1
            self._open = True

    def read(self):
        assert self._open, "read without being open"
        step = self._script.get(timeout=self._timeout)
        if isinstance(step, BaseException):
            raise step
        return step

    def close(self):
        self.closed += self._open
        self._open = False
