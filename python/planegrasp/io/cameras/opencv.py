"""Any camera or network stream that OpenCV opens, without depth."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.errors import CameraError, CameraLostError, InvalidInputError
from planegrasp.io.cameras.mode import StreamMode
from planegrasp.io.sources.base import ASSUMED_FIELD_OF_VIEW, assumed_camera, assumption_note
from planegrasp.rgbd import RGBDFrame

if TYPE_CHECKING:
    from planegrasp.geometry import PinholeCamera

_NETWORK_TIMEOUT = 5000  # OpenCV's own for streams is 30 s [ms]


class OpenCVCamera:
    """A `Camera` by `cv2.VideoCapture`; timestamps are the instants at which frames arrived.

    Attributes:
        name: as for `open_camera`.
        notes: that the focal length is assumed, where it is.
    """

    def __init__(
        self,
        device: str,
        camera: PinholeCamera | None = None,
        field_of_view: float | None = None,
        mode: StreamMode | None = None,
    ) -> None:
        """Remember what to open.

        Args:
            device: number of a camera, or URL or path of a stream.
            camera: intrinsics.
            field_of_view: horizontal [rad], where there are no intrinsics.
            mode: size and rate to ask a numbered camera for, which takes the nearest it has.

        Raises:
            InvalidInputError: a mode for a stream, which has that in which it is sent.
        """
        self.name = f"opencv:{device}"
        self.notes = () if camera is not None else (assumption_note(field_of_view),)
        self._device = device
        self._camera = camera
        self._angle = ASSUMED_FIELD_OF_VIEW if field_of_view is None else field_of_view
        self._mode = mode or StreamMode()
        if not device.isdecimal() and self._mode != StreamMode():
            raise InvalidInputError(
                f"size and rate can be chosen of numbered cameras (opencv:0), not of {self.name}"
            )
        self._capture: cv2.VideoCapture | None = None
        self._number = 0

    def open(self) -> None:
        """See `Camera.open`."""
        if self._capture is not None:
            return
        capture = self._opened()
        if not capture.isOpened():
            capture.release()
            raise CameraLostError(f"{self.name} cannot be opened: it is not there, or is in use")
        self._capture = capture

    def read(self) -> RGBDFrame:
        """See `Camera.read`."""
        if self._capture is None:
            raise CameraLostError(f"{self.name} is not open")
        arrived, bgr = self._capture.read()
        stamp = time.time()
        if not arrived or bgr is None:
            raise CameraLostError(f"{self.name} gives no frames any more")
        color = np.ascontiguousarray(np.asarray(bgr, dtype=np.uint8)[:, :, ::-1])
        height, width = color.shape[:2]
        camera = self._camera or assumed_camera(width, height, self._angle)
        name = f"{self._number:06d}"
        self._number += 1
        try:
            return RGBDFrame(color, None, camera, name, stamp)
        except CameraError as error:
            raise CameraError(f"{self.name}: {error}") from error

    def close(self) -> None:
        """See `Camera.close`."""
        if self._capture is not None:
            self._capture.release()
            self._capture = None

    def _opened(self) -> cv2.VideoCapture:
        # OpenCV warns of a camera that is not there; the error says so already, at each trial.
        level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
        try:
            return self._tried()
        finally:
            cv2.utils.logging.setLogLevel(level)

    def _tried(self) -> cv2.VideoCapture:
        if not self._device.isdecimal():
            timeouts = [
                cv2.CAP_PROP_OPEN_TIMEOUT_MSEC,
                _NETWORK_TIMEOUT,
                cv2.CAP_PROP_READ_TIMEOUT_MSEC,
                _NETWORK_TIMEOUT,
            ]
            return cv2.VideoCapture(self._device, cv2.CAP_FFMPEG, timeouts)
        capture = cv2.VideoCapture(int(self._device))
        wanted = {
            cv2.CAP_PROP_FRAME_WIDTH: self._mode.width,
            cv2.CAP_PROP_FRAME_HEIGHT: self._mode.height,
            cv2.CAP_PROP_FPS: self._mode.frames_per_second,
        }
        for setting, value in wanted.items():
            if value is not None:
                capture.set(setting, value)
        return capture
