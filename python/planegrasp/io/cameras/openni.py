"""Kinect-class sensors (Kinect, Xtion, Astra, …) through OpenNI2: colour and registered depth."""

from __future__ import annotations

import ctypes.util
import math
import os
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.errors import CameraError, CameraLostError, MissingExtraError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.cameras.mode import StreamMode
from planegrasp.io.pairing import FramePairing
from planegrasp.io.sources.base import ASSUMED_FIELD_OF_VIEW, assumed_camera, assumption_note
from planegrasp.rgbd import RGBDFrame

try:
    from openni import _openni2, openni2
    from openni.utils import OpenNIError
except ImportError as error:
    raise MissingExtraError("OpenNI2 sensors", "openni", str(error)) from error

if TYPE_CHECKING:
    from numpy.typing import NDArray

_TIMEOUT = 2.0  # without a frame, after which the sensor is lost [s]
_DEPTH_UNITS = {  # metres a unit, by pixel format
    openni2.PIXEL_FORMAT_DEPTH_1_MM.value: np.float32(1e-3),
    openni2.PIXEL_FORMAT_DEPTH_100_UM.value: np.float32(1e-4),
}


class OpenNICamera:
    """A `Camera` by OpenNI2's drivers.

    Timestamps are the device's, counted from the arrival of the first frame. A colour frame without
    depth within half a frame in time comes without depth. Intrinsics are the nominal field of view
    of the driver, or an assumed one.

    Attributes:
        name: as for `open_camera`.
        notes: what is assumed of the lens, and that depth is not aligned where this is so.
    """

    def __init__(
        self,
        uri: str = "",
        camera: PinholeCamera | None = None,
        field_of_view: float | None = None,
        mode: StreamMode | None = None,
    ) -> None:
        """Remember what to open, and load OpenNI2.

        Args:
            uri: of the device; the first sensor where it is empty.
            camera: intrinsics of the colour image.
            field_of_view: horizontal [rad], where there are no intrinsics.
            mode: size and rate of both images, by default 640×480 at 30 Hz where the sensor has it.

        Raises:
            MissingExtraError: the OpenNI2 library is not there.
        """
        _load_library()
        self.name = f"openni:{uri}" if uri else "openni"
        self.notes: tuple[str, ...] = ()
        self._uri = uri
        self._given = camera
        self._angle = field_of_view
        self._mode = mode or StreamMode()
        self._device: Any = None
        self._color: Any = None
        self._depth: Any = None
        self._pairing: FramePairing[NDArray[np.uint8], NDArray[np.float32]]
        self._camera: PinholeCamera | None = None
        self._offset: float | None = None
        self._number = 0

    def open(self) -> None:
        """See `Camera.open`.

        Raises:
            CameraLostError: it is not there, is in use, or does not start.
            CameraError: it does not give colour and depth of the wanted size and rate.
        """
        if self._device is not None:
            return
        try:
            self._start()
        except OpenNIError as error:
            self.close()
            raise CameraLostError(f"{self.name} does not start: {_message(error)}") from error
        except BaseException:
            self.close()
            raise

    def read(self) -> RGBDFrame:
        """See `Camera.read`."""
        if self._device is None:
            raise CameraLostError(f"{self.name} is not open")
        deadline = time.monotonic() + _TIMEOUT
        while (left := deadline - time.monotonic()) > 0:
            try:
                stream = openni2.wait_for_any_stream([self._depth, self._color], left)
                ready = [] if stream is None else self._paired(stream)
            except OpenNIError as error:
                raise CameraLostError(f"{self.name}: {_message(error)}") from error
            if stream is None:
                break
            if ready:
                return self._frame(*ready[-1])
        raise CameraLostError(f"{self.name} gives no frames any more")

    def close(self) -> None:
        """See `Camera.close`."""
        for opened in (self._depth, self._color, self._device):
            if opened is not None:
                with suppress(OpenNIError):  # what an unplugged sensor answers
                    opened.close()
        self._depth = self._color = self._device = None

    def _start(self) -> None:
        self._device = openni2.Device(os.fsencode(self._uri) if self._uri else None)
        self._color = self._device.create_color_stream()
        self._depth = self._device.create_depth_stream()
        if self._color is None or self._depth is None:
            raise CameraError(f"{self.name} does not give both colour and depth")
        self._configure(self._color, openni2.PIXEL_FORMAT_RGB888)
        self._configure(self._depth, openni2.PIXEL_FORMAT_DEPTH_1_MM)
        self.notes = ()
        aligned = openni2.IMAGE_REGISTRATION_DEPTH_TO_COLOR
        if self._device.is_image_registration_mode_supported(aligned):
            self._device.set_image_registration_mode(aligned)
        else:
            self.notes += (f"{self.name} does not align depth to colour: distances may be off",)
        with suppress(OpenNIError):  # not all drivers have it
            self._device.set_depth_color_sync_enabled(True)
        mode = self._color.get_video_mode()
        self._camera = self._given or self._nominal(mode.resolutionX, mode.resolutionY)
        self._pairing = FramePairing(0.5 / max(mode.fps, 1))
        self._offset = None
        self._depth.start()
        self._color.start()

    def _configure(self, stream: Any, pixels: Any) -> None:
        with suppress(OpenNIError):
            stream.set_mirroring_enabled(False)
        wanted = self._mode
        size = (wanted.width or 640, wanted.height or 480, wanted.frames_per_second or 30)
        with suppress(OpenNIError):
            stream.configure_mode(*size, pixels)
        mode = stream.get_video_mode()
        has = (mode.resolutionX, mode.resolutionY, mode.fps)
        if (wanted.width and has[:2] != size[:2]) or (
            wanted.frames_per_second and has[2] != size[2]
        ):
            raise CameraError(
                f"{self.name} has no images of {size[0]}×{size[1]} at {size[2]} Hz; it gives "
                f"{has[0]}×{has[1]} at {has[2]} Hz"
            )

    def _nominal(self, width: int, height: int) -> PinholeCamera:
        if self._angle is None:
            try:
                across, down = self._color.get_horizontal_fov(), self._color.get_vertical_fov()
            except OpenNIError:
                across = down = 0.0
            if 0.0 < across < math.pi and 0.0 < down < math.pi:
                fx, fy = width / 2 / math.tan(across / 2), height / 2 / math.tan(down / 2)
                self.notes += (
                    f"taking the nominal field of view of {self.name}, "
                    f"{math.degrees(across):.3g}°; give a camera file for exact poses",
                )
                return PinholeCamera(width, height, fx, fy, (width - 1) / 2, (height - 1) / 2)
        self.notes += (assumption_note(self._angle),)
        angle = ASSUMED_FIELD_OF_VIEW if self._angle is None else self._angle
        return assumed_camera(width, height, angle)

    def _paired(
        self, stream: Any
    ) -> list[tuple[float, NDArray[np.uint8], NDArray[np.float32] | None]]:
        frame = stream.read_frame()
        try:
            stamp = frame.timestamp / 1e6
            if stream is self._depth:
                return self._pairing.second(stamp, self._metres(frame))
            return self._pairing.first(stamp, self._rgb(frame))
        finally:
            frame.close()

    def _rgb(self, frame: Any) -> NDArray[np.uint8]:
        if frame.videoMode.pixelFormat.value != openni2.PIXEL_FORMAT_RGB888.value:
            raise CameraError(f"{self.name} gives {frame.videoMode.pixelFormat}, expected RGB888")
        rows = np.frombuffer(frame.get_buffer_as_uint8(), np.uint8, frame.height * frame.stride)
        pixels = rows.reshape(frame.height, frame.stride)[:, : 3 * frame.width]
        return pixels.reshape(frame.height, frame.width, 3).copy()

    def _metres(self, frame: Any) -> NDArray[np.float32]:
        unit = _DEPTH_UNITS.get(frame.videoMode.pixelFormat.value)
        if unit is None:
            raise CameraError(f"{self.name} gives {frame.videoMode.pixelFormat}, expected depth")
        rows = np.frombuffer(frame.get_buffer_as_uint8(), np.uint8, frame.height * frame.stride)
        pixels = rows.reshape(frame.height, frame.stride)[:, : 2 * frame.width]
        return np.asarray(pixels.copy().view(np.uint16) * unit, dtype=np.float32)

    def _frame(
        self, seconds: float, color: NDArray[np.uint8], depth: NDArray[np.float32] | None
    ) -> RGBDFrame:
        if self._offset is None:
            self._offset = time.time() - seconds
        if depth is not None and depth.shape != color.shape[:2]:
            raise CameraError(
                f"{self.name} gives depth of {depth.shape[1]}×{depth.shape[0]} with colour of "
                f"{color.shape[1]}×{color.shape[0]}: ask for a size that both have"
            )
        assert self._camera is not None
        name = f"{self._number:06d}"
        self._number += 1
        try:
            return RGBDFrame(color, depth, self._camera, name, seconds + self._offset)
        except CameraError as error:
            raise CameraError(f"{self.name}: {error}") from error


def _load_library() -> None:
    """Load OpenNI2 and its drivers; the binding by itself misses most systems' file names."""
    if openni2.is_initialized():
        return
    if not openni2.loaded_dll_directory:
        folders = (os.environ.get(key) for key in ("OPENNI2_REDIST64", "OPENNI2_REDIST"))
        files = (Path(folder) / "libOpenNI2.so" for folder in folders if folder)
        found = next((str(file) for file in files if file.is_file()), None)
        library = found or ctypes.util.find_library("OpenNI2")
        if library is None:
            raise MissingExtraError(
                "OpenNI2 sensors",
                "openni",
                "and libOpenNI2 of your system, package libopenni2-0 on Debian and Ubuntu, or a "
                "folder named by OPENNI2_REDIST64",
            )
        _openni2.load_dll(library)
        openni2.loaded_dll_directory = str(Path(library).parent)
    openni2.initialize()


def _message(error: OpenNIError) -> str:
    text = error.args[1]
    return text.decode(errors="replace") if isinstance(text, bytes) else str(text)
