"""What writes frames, and what happens where it cannot go on."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import RecordingError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from planegrasp.rgbd import RGBDFrame

_USUAL_INTERVAL = 1 / 30


class Recorder(ClosesAtEnd):
    """Writes frames; a context manager that finishes the recording at its end.

    A frame that was written is on disk and can be read back, also where the process is killed after
    it or the disk gets full.

    Attributes:
        path: of the recording.
        frames: how many were written.
        seconds: between the timestamps of the first and the last of them.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.frames = 0
        self._first: float | None = None
        self._last: float | None = None
        self._failed = False

    @property
    def seconds(self) -> float:
        """Between the timestamps of the first and the last frame."""
        return 0.0 if self._first is None or self._last is None else self._last - self._first

    def write(self, frame: RGBDFrame) -> None:
        """Write one frame. One without a timestamp comes 1/30 s after the one before it.

        Raises:
            RecordingError: it cannot be written, for example because the disk is full; what was
                written before stays readable, and nothing can be written after it.
            InvalidInputError: the recording cannot hold this frame beside those before it.
        """
        if self._failed:
            raise RecordingError(f"{self.path} could not be written any further, see before")
        stamp = stamp_after(self._last, frame.timestamp)
        try:
            self._write(frame, stamp)
        except OSError as error:
            self._failed = True
            self._give_up()
            raise RecordingError(
                f"{self.path} cannot be written any further: {error.strerror or error}; the "
                f"{self.frames} frames before ({self.seconds:.1f} s) can be read"
            ) from error
        self.frames += 1
        self._first = stamp if self._first is None else self._first
        self._last = stamp

    def close(self) -> None:
        """Finish the recording.

        Raises:
            RecordingError: its end cannot be written; all frames can be read nevertheless.
        """
        if self._failed:
            return
        try:
            self._finish()
        except OSError as error:
            self._failed = True
            raise RecordingError(
                f"the end of {self.path} cannot be written: {error.strerror or error}; its "
                f"{self.frames} frames can be read"
            ) from error

    @abstractmethod
    def _write(self, frame: RGBDFrame, stamp: float) -> None:
        """Write a frame with its timestamp [s] to the disk."""

    @abstractmethod
    def _finish(self) -> None:
        """Write the end; may be called again."""

    def _give_up(self) -> None:
        """Release what is open after a failure, without an exception."""


def stamp_after(last: float | None, stamp: float | None) -> float:
    """The timestamp of a frame [s]; one without comes 1/30 s after the last, or at 0."""
    if stamp is not None and math.isfinite(stamp):
        return stamp
    return 0.0 if last is None else last + _USUAL_INTERVAL


def whole_millimetres(depth: NDArray[np.float32]) -> bool:
    """Whether depth [m] is kept exactly by 16-bit millimetres, as most sensors give it."""
    units = depth * 1000.0
    rounded = np.rint(units)
    return bool(np.all(np.abs(units - rounded) < 1e-2) and rounded.max(initial=0.0) <= 65535)
