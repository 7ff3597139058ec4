"""The RealSense driver on librealsense's own software device."""

from __future__ import annotations

import threading
import time
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("pyrealsense2", reason="pyrealsense2 cannot be imported", exc_type=ImportError)

import pyrealsense2 as rs

from planegrasp.errors import CameraError, CameraLostError, InvalidInputError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.cameras import EventKind, NewestFrame, StreamConfig, StreamStatus, open_camera
from planegrasp.io.cameras.mode import StreamMode
from planegrasp.io.cameras.realsense import RealSenseCamera

WIDTH, HEIGHT = 64, 48
BASELINE = 0.05  # the depth sensor's origin lies 5 cm to the left of the colour camera [m]
NEAR, FAR = 1.0, 3.0  # a block before a wall [m]
BLOCK = slice(20, 40)  # its columns in the depth image
QUICK = StreamConfig(first_retry=0.01, longest_retry=0.05)


def intrinsics(model, coefficients):
    i = rs.intrinsics()
    i.width, i.height = WIDTH, HEIGHT
    i.fx, i.fy, i.ppx, i.ppy = 60.0, 61.0, 31.0, 24.0
    i.model, i.coeffs = model, coefficients
    return i


class SoftwareCamera:
    """A software device with a depth and a colour sensor, and a thread that sends its frames."""

    def __init__(self, model=rs.distortion.brown_conrady, coefficients=(0.0,) * 5):
        self.device = rs.software_device()
        self.device.register_info(rs.camera_info.serial_number, "0123")
        self.depth_sensor = self.device.add_sensor("Stereo Module")
        self.color_sensor = self.device.add_sensor("RGB Camera")
        plain = intrinsics(rs.distortion.none, [0.0] * 5)
        lens = intrinsics(model, list(coefficients))
        self.depth = self._stream(self.depth_sensor, rs.stream.depth, rs.format.z16, 2, plain)
        self.color = self._stream(self.color_sensor, rs.stream.color, rs.format.rgb8, 3, lens)
        self.depth_sensor.add_read_only_option(rs.option.depth_units, 0.001)
        extrinsics = rs.extrinsics()
        extrinsics.rotation = [1, 0, 0, 0, 1, 0, 0, 0, 1]
        extrinsics.translation = [-BASELINE, 0, 0]
        self.depth.register_extrinsics_to(self.color, extrinsics)
        self.device.create_matcher(rs.matchers.default)
        self.sends_depth, self.silent = True, False
        self.domain = rs.timestamp_domain.hardware_clock
        self.sent = 0
        self.clock = 0.0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._send)

    @staticmethod
    def _stream(sensor, kind, pixels, size, lens):
        stream = rs.video_stream()
        stream.type, stream.index, stream.uid = kind, 0, int(kind)
        stream.width, stream.height, stream.fps = WIDTH, HEIGHT, 30
        stream.bpp, stream.fmt, stream.intrinsics = size, pixels, lens
        return sensor.add_video_stream(stream, True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()

    def _send(self):
        depth = np.full((HEIGHT, WIDTH), round(1000 * FAR), np.uint16)
        depth[:, BLOCK] = round(1000 * NEAR)
        while not self._stop.wait(1 / 30):
            if self.silent:
                continue
            self.sent += 1
            color = np.full((HEIGHT, WIDTH, 3), (250, 100, self.sent % 256), np.uint8)
            if self.sends_depth:
                self._give(self.depth_sensor, self.depth, depth, 2)
            self._give(self.color_sensor, self.color, color, 3)

    def _give(self, sensor, profile, pixels, size):
        frame = rs.software_video_frame()
        frame.pixels, frame.bpp, frame.stride = pixels, size, WIDTH * size
        frame.timestamp = 1000 * self.clock + self.sent * 1000 / 30
        frame.domain, frame.frame_number = self.domain, self.sent
        frame.profile = profile.as_video_stream_profile()
        if size == 2:
            frame.depth_units = 0.001
        sensor.on_video_frame(frame)


def camera_of(software, **options):
    return RealSenseCamera(find_device=lambda serial: software.device, **options)


def test_colour_and_aligned_depth():
    with SoftwareCamera() as software, NewestFrame(camera_of(software)) as live:
        frames = [live.next() for _ in range(10)]
    frame = next(f for f in frames if f.depth is not None)
    assert frame.camera == PinholeCamera(WIDTH, HEIGHT, 60.0, 61.0, 31.0, 24.0)
    np.testing.assert_array_equal(frame.color[5, 5, :2], (250, 100), "red first")
    assert frame.depth.dtype == np.float32
    near = np.flatnonzero(np.isclose(frame.depth[20], NEAR, atol=1e-6))
    # Seen from the colour camera the block lies f · baseline / depth = 3 px farther left.
    assert abs(near[0] - (BLOCK.start - 3)) <= 1
    assert abs(near[-1] - (BLOCK.stop - 1 - 3)) <= 1
    far = frame.depth[frame.depth > NEAR + 0.1]
    np.testing.assert_allclose(far, FAR, atol=1e-6)


def test_timestamps_are_of_this_computer():
    before = time.time()
    with SoftwareCamera() as software, NewestFrame(camera_of(software)) as live:
        stamps = [live.next().timestamp for _ in range(5)]
    assert before <= stamps[0] <= time.time()
    assert all(a < b for a, b in pairwise(stamps))
    # The device's own clock counts thirtieths of a second, however late the frames are taken.
    steps = np.diff(stamps) * 30
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-3)


def test_timestamps_that_librealsense_translated_stay():
    with SoftwareCamera() as software, NewestFrame(camera_of(software)) as live:
        software.clock, software.domain = 1.7e9, rs.timestamp_domain.global_time
        stamps = [live.next().timestamp for _ in range(10)]
    assert 1.7e9 < stamps[-1] < 1.7e9 + 60


def test_depth_that_stops():
    with SoftwareCamera() as software, NewestFrame(camera_of(software)) as live:
        while live.next().depth is None:
            pass
        software.sends_depth = False
        frames = [live.next() for _ in range(40)]
        assert [e.kind for e in live.take_events()] == [EventKind.DEPTH_LOST]
        assert all(f.depth is None for f in frames[-10:])
        software.sends_depth = True
        while live.next().depth is None:
            pass
        assert [e.kind for e in live.take_events()] == [EventKind.DEPTH_FOUND]
        assert live.losses == 0


def test_a_camera_that_vanishes_and_comes_back(until):
    plugged = True

    def find(serial):
        if not plugged:
            raise CameraLostError("no RealSense is plugged in")
        return software.device

    with (
        SoftwareCamera() as software,
        NewestFrame(RealSenseCamera(find_device=find), QUICK) as live,
    ):
        assert live.next() is not None
        plugged, software.silent = False, True
        until(lambda: live.status is StreamStatus.LOST)
        assert [e.kind for e in live.take_events()] == [EventKind.LOST]
        plugged, software.silent = True, False
        until(lambda: live.status is StreamStatus.RUNNING)
        assert live.next() is not None
        assert [e.kind for e in live.take_events()] == [EventKind.FOUND]
        assert live.losses == 1


def test_no_camera_is_plugged_in():
    if len(rs.context().query_devices()):
        pytest.skip("a RealSense is plugged in")
    with pytest.raises(CameraLostError, match="no RealSense is plugged in"):
        open_camera("realsense").open()
    with pytest.raises(CameraLostError, match="no RealSense 0123 is plugged in"):
        NewestFrame(open_camera("realsense:0123"))


def test_reading_a_camera_that_is_not_open():
    camera = RealSenseCamera("0123")
    with pytest.raises(CameraLostError, match="realsense:0123 is not open"):
        camera.read()
    camera.close()
    with pytest.raises(InvalidInputError, match="a RealSense knows its intrinsics"):
        open_camera("realsense", field_of_view=1.0)


def test_given_intrinsics_win():
    given = PinholeCamera(WIDTH, HEIGHT, 70.0, 70.0, 31.5, 23.5)
    with SoftwareCamera() as software, NewestFrame(camera_of(software, camera=given)) as live:
        assert live.next().camera == given


def test_a_size_that_the_camera_does_not_have():
    software = SoftwareCamera()
    camera = camera_of(software, mode=StreamMode(640, 480, 15))
    with pytest.raises(CameraError, match="no colour of 640×480 at 15 Hz; it has 64×48 at 30 Hz"):
        camera.open()
    camera.close()


def test_distortion_is_taken_over():
    k = (0.1, -0.05, 0.001, 0.002, 0.01)
    software = SoftwareCamera(rs.distortion.brown_conrady, k)
    camera = camera_of(software)
    camera.open()
    assert camera._camera.distortion == pytest.approx(k)
    camera.close()


def test_an_inverse_lens_model_is_turned_round():
    k = (0.1, -0.05, 0.001, 0.002, 0.01)
    software = SoftwareCamera(rs.distortion.inverse_brown_conrady, k)
    camera = camera_of(software)
    camera.open()
    ours, own = camera._camera, intrinsics(rs.distortion.inverse_brown_conrady, list(k))
    for pixel in [(0.0, 0.0), (10.0, 40.0), (63.0, 24.0), (31.0, 24.0)]:
        point = rs.rs2_deproject_pixel_to_point(own, list(pixel), 2.0)
        np.testing.assert_allclose(ours.project([point])[0], pixel, atol=0.05)
    assert camera.notes == ()
    camera.close()
