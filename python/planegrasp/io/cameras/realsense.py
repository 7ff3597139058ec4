"""RealSense cameras: colour, and depth aligned to it, by librealsense."""

from __future__ import annotations

import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.errors import CameraError, CameraLostError, MissingExtraError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.cameras.mode import StreamMode
from planegrasp.io.lens import brown_conrady
from planegrasp.rgbd import RGBDFrame

try:
    import pyrealsense2 as rs
except ImportError as error:
    raise MissingExtraError("RealSense cameras", "realsense", str(error)) from error

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_USUAL = (640, 480, 30)  # taken where nothing is asked for [px, px, Hz]
_TIMEOUT = 2000  # without a frame, after which the camera is lost [ms]


class RealSenseCamera:
    """A `Camera` by pyrealsense2.

    Timestamps are the device's, which librealsense translates to this computer's clock, or which
    count from the arrival of the first frame where it does not. Where depth stops while colour
    goes on, frames come without depth.

    Attributes:
        name: as for `open_camera`.
        notes: that lens distortion could not be taken over, where this is so.
    """

    def __init__(
        self,
        serial: str = "",
        camera: PinholeCamera | None = None,
        mode: StreamMode | None = None,
        find_device: Callable[[str], Any] | None = None,
    ) -> None:
        """Remember what to open.

        Args:
            serial: number of the camera; the first one where it is empty.
            camera: intrinsics of the colour image, instead of the device's own.
            mode: size and rate of colour; depth has the nearest size.
            find_device: gives the `pyrealsense2.device` for a serial number; by default it is
                looked for among those that are plugged in.
        """
        self.name = f"realsense:{serial}" if serial else "realsense"
        self.notes: tuple[str, ...] = ()
        self._serial = serial
        self._given = camera
        self._mode = mode or StreamMode()
        self._find_device = find_device or _plugged_in
        self._sensors: list[Any] = []
        self._syncer: Any = None
        self._align = rs.align(rs.stream.color)
        self._camera: PinholeCamera | None = None
        self._offset: float | None = None

    def open(self) -> None:
        """See `Camera.open`.

        Raises:
            CameraLostError: it is not there, is in use, or does not start.
            CameraError: it does not give images of the wanted size and rate.
        """
        if self._sensors:
            return
        try:
            self._start(self._find_device(self._serial))
        except RuntimeError as error:
            self.close()
            raise CameraLostError(f"{self.name} does not start: {error}") from error
        except BaseException:
            self.close()
            raise

    def read(self) -> RGBDFrame:
        """See `Camera.read`."""
        if self._syncer is None:
            raise CameraLostError(f"{self.name} is not open")
        deadline = time.monotonic() + _TIMEOUT / 1000
        while (left := deadline - time.monotonic()) > 0:
            try:
                arrived, frames = self._syncer.try_wait_for_frames(max(1, int(1000 * left)))
            except RuntimeError as error:
                raise CameraLostError(f"{self.name}: {error}") from error
            if arrived and frames.get_color_frame():
                return self._frame(frames)
        raise CameraLostError(f"{self.name} gives no frames any more")

    def close(self) -> None:
        """See `Camera.close`."""
        for sensor in self._sensors:
            with suppress(RuntimeError):  # what an unplugged device answers
                sensor.stop()
            with suppress(RuntimeError):
                sensor.close()
        self._sensors = []
        self._syncer = None

    def _start(self, device: Any) -> None:
        profiles = [(s, p) for s in device.query_sensors() for p in s.get_stream_profiles()]
        color_sensor, color = self._color(profiles)
        depth_sensor, depth = self._depth(profiles, color)
        intrinsics = color.get_intrinsics()
        self._camera = self._given or self._own(intrinsics)
        self._offset = None
        self._syncer = rs.syncer()
        by_sensor = [(color_sensor, [color]), (depth_sensor, [depth])]
        if color_sensor.get_info(rs.camera_info.name) == depth_sensor.get_info(rs.camera_info.name):
            by_sensor = [(color_sensor, [color, depth])]
        for sensor, wanted in by_sensor:
            sensor.open(wanted)
            self._sensors.append(sensor)
            sensor.start(self._syncer)

    def _color(self, profiles: Sequence[tuple[Any, Any]]) -> tuple[Any, Any]:
        mode = self._mode
        offered = _video(profiles, rs.stream.color, rs.format.rgb8)
        fitting = [
            (sensor, p)
            for sensor, p in offered
            if mode.width in (None, p.width())
            and mode.height in (None, p.height())
            and mode.frames_per_second in (None, p.fps())
        ]
        if fitting:
            return min(fitting, key=lambda pair: _distance(pair[1], *_USUAL))
        sizes = sorted({(p.width(), p.height(), p.fps()) for _, p in offered})
        raise CameraError(
            f"{self.name} has no colour of {mode.width or 'any'}×{mode.height or 'any'} at "
            f"{mode.frames_per_second or 'any'} Hz; it has "
            + (", ".join(f"{w}×{h} at {r} Hz" for w, h, r in sizes) or "no colour at all")
        )

    def _depth(self, profiles: Sequence[tuple[Any, Any]], color: Any) -> tuple[Any, Any]:
        offered = [
            (sensor, profile)
            for sensor, profile in _video(profiles, rs.stream.depth, rs.format.z16)
            if profile.fps() == color.fps()
        ]
        if not offered:
            raise CameraError(f"{self.name} has no depth at {color.fps()} Hz")
        size = (color.width(), color.height(), color.fps())
        return min(offered, key=lambda pair: _distance(pair[1], *size))

    def _own(self, intrinsics: Any) -> PinholeCamera:
        i = intrinsics
        if i.model == rs.distortion.brown_conrady or not any(i.coeffs):
            distortion, error = tuple(i.coeffs) if any(i.coeffs) else (), 0.0
        else:
            distortion, error = brown_conrady(
                (i.width, i.height),
                (i.ppx, i.ppy),
                (i.fx, i.fy),
                lambda pixel: rs.rs2_deproject_pixel_to_point(i, list(pixel), 1.0),
            )
        self.notes = ()
        if error > 0.1:
            self.notes = (f"the lens model of {self.name} is met to {error:.2g} px only",)
        return PinholeCamera(i.width, i.height, i.fx, i.fy, i.ppx, i.ppy, distortion)

    def _frame(self, frames: Any) -> RGBDFrame:
        if frames.get_depth_frame():
            frames = self._align.process(frames)
        color, depth = frames.get_color_frame(), frames.get_depth_frame()
        metres = None
        if depth:
            metres = np.asarray(depth.get_data()) * np.float32(depth.get_units())
        assert self._camera is not None
        try:
            return RGBDFrame(
                np.array(color.get_data()),  # a copy: the buffer goes back to librealsense
                metres,
                self._camera,
                f"{color.get_frame_number():06d}",
                self._stamp(color),
            )
        except CameraError as error:
            raise CameraError(f"{self.name}: {error}") from error

    def _stamp(self, frame: Any) -> float:
        seconds = float(frame.get_timestamp()) / 1000
        if frame.get_frame_timestamp_domain() != rs.timestamp_domain.hardware_clock:
            return seconds
        if self._offset is None:
            self._offset = time.time() - seconds
        return seconds + self._offset


def _plugged_in(serial: str) -> Any:
    devices = list(rs.context().query_devices())
    numbers = [device.get_info(rs.camera_info.serial_number) for device in devices]
    for device, number in zip(devices, numbers, strict=True):
        if serial in ("", number):
            return device
    wanted = f"RealSense {serial}" if serial else "RealSense"
    there = f", only {', '.join(numbers)}" if numbers else ""
    raise CameraLostError(f"no {wanted} is plugged in{there}")


def _video(profiles: Sequence[tuple[Any, Any]], stream: Any, pixels: Any) -> list[tuple[Any, Any]]:
    return [
        (sensor, profile.as_video_stream_profile())
        for sensor, profile in profiles
        if profile.stream_type() == stream and profile.format() == pixels
    ]


def _distance(profile: Any, width: int, height: int, rate: int) -> int:
    sizes = abs(profile.width() - width) + abs(profile.height() - height)
    return int(sizes + abs(profile.fps() - rate))
