"""OpenCV's cameras, tried with a network camera that can be switched off."""

from __future__ import annotations

import sys
import threading
import time
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np
import pytest

from planegrasp.errors import (
    CameraError,
    CameraLostError,
    InvalidInputError,
    MissingExtraError,
    SourceError,
)
from planegrasp.geometry import PinholeCamera
from planegrasp.io.cameras import (
    EventKind,
    NewestFrame,
    StreamConfig,
    StreamStatus,
    is_camera_name,
    open_camera,
)

SIZE = (64, 48)


class NetworkCamera(BaseHTTPRequestHandler):
    """Sends JPEG images of one colour without end, as network cameras do."""

    def do_GET(self):
        image = np.full((SIZE[1], SIZE[0], 3), (0, 0, 200), np.uint8)  # red, as OpenCV has it
        data = cv2.imencode(".jpg", image)[1].tobytes()
        part = f"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        self.end_headers()
        try:
            while not self.server.unplugged.is_set():
                self.wfile.write(part.encode() + data + b"\r\n")
                time.sleep(0.01)
        except OSError:
            pass  # the viewer has gone
        self.close_connection = True

    def log_message(self, *_):
        pass


@contextmanager
def plugged_in(port=0):
    server = ThreadingHTTPServer(("127.0.0.1", port), NetworkCamera)
    server.unplugged = threading.Event()
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    try:
        yield server.server_address[1]
    finally:
        server.unplugged.set()
        server.shutdown()
        server.server_close()
        thread.join()


def test_frames_of_a_network_camera(until):
    with plugged_in() as port:
        camera = open_camera(f"opencv:http://127.0.0.1:{port}/video")
        assert "assuming a horizontal field of view of 60°" in camera.notes[0]
        before = time.time()
        with NewestFrame(camera) as live:
            frame = live.next()
            later = live.next()
    assert frame.color.shape == (SIZE[1], SIZE[0], 3)
    np.testing.assert_allclose(frame.color[10, 10], (200, 0, 0), atol=4)
    assert frame.depth is None
    assert frame.camera.width == SIZE[0]
    assert before < frame.timestamp < later.timestamp <= time.time()


def test_a_network_camera_that_is_switched_off_and_on(until):
    config = StreamConfig(first_retry=0.02, longest_retry=0.05)
    with plugged_in() as port:
        live = NewestFrame(open_camera(f"opencv:http://127.0.0.1:{port}/video"), config)
        assert live.next() is not None
    with live:
        until(lambda: live.status is StreamStatus.LOST)
        (lost,) = live.take_events()
        assert lost.kind is EventKind.LOST
        with plugged_in(port):
            until(lambda: live.status is StreamStatus.RUNNING)
            assert [e.kind for e in live.take_events()] == [EventKind.FOUND]
            assert live.losses == 1
            live.close()


def test_a_camera_that_is_not_there():
    camera = open_camera("opencv:97")
    with pytest.raises(CameraLostError, match="opencv:97 cannot be opened: it is not there"):
        camera.open()
    with pytest.raises(CameraLostError, match="opencv:97 is not open"):
        camera.read()
    camera.close()


def test_given_intrinsics():
    fits = PinholeCamera(*SIZE, 50.0, 50.0, 31.5, 23.5)
    other = PinholeCamera(640, 480, 500.0, 500.0, 319.5, 239.5)
    with plugged_in() as port:
        name = f"opencv:http://127.0.0.1:{port}/video"
        assert open_camera(name, camera=fits).notes == ()
        with NewestFrame(open_camera(name, camera=fits)) as live:
            assert live.next().camera == fits
        with (
            NewestFrame(open_camera(name, camera=other)) as live,
            pytest.raises(CameraError, match="the camera is for 640×480 images, this image is 64"),
        ):
            live.next()


def test_field_of_view_is_used():
    with plugged_in() as port:
        camera = open_camera(f"opencv:http://127.0.0.1:{port}/video", field_of_view=np.pi / 2)
        with NewestFrame(camera) as live:
            assert live.next().camera.fx == pytest.approx(SIZE[0] / 2)


def test_names():
    assert open_camera("opencv").name == "opencv:0"
    assert is_camera_name("realsense")
    assert is_camera_name("opencv:rtsp://host/stream")
    assert not is_camera_name("recordings/opencv")
    assert not is_camera_name("./realsense")
    with pytest.raises(InvalidInputError, match=r"named 'kinect:0': expected realsense"):
        open_camera("kinect:0")


def test_options_that_cannot_be():
    camera = PinholeCamera(*SIZE, 50.0, 50.0, 31.5, 23.5)
    with pytest.raises(SourceError, match="not both"):
        open_camera("opencv:0", camera=camera, field_of_view=1.0)
    with pytest.raises(InvalidInputError, match="between 0° and 180°, got 229"):
        open_camera("opencv:0", field_of_view=4.0)
    with pytest.raises(InvalidInputError, match="together, got 640 and None"):
        open_camera("opencv:0", width=640)
    with pytest.raises(InvalidInputError, match=r"numbered cameras \(opencv:0\), not of opencv:rt"):
        open_camera("opencv:rtsp://host/stream", frames_per_second=15)
    with pytest.raises(InvalidInputError, match="must be > 0"):
        open_camera("opencv:0", frames_per_second=0)


@pytest.mark.parametrize(
    ("driver", "module"), [("realsense", "pyrealsense2"), ("openni", "openni")]
)
def test_a_driver_that_is_not_installed_says_what_to_install(driver, module, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.delitem(sys.modules, f"planegrasp.io.cameras.{driver}", raising=False)
    with pytest.raises(MissingExtraError, match=rf"pip install 'planegrasp\[{driver}\]'"):
        open_camera(driver)
