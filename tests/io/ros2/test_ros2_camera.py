"""A camera whose driver publishes on ROS 2."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import replace

import cv2
import numpy as np
import pytest
from ros2_driver import CAMERA, COLOR, DEPTH, INFO, Driver, color_image, depth_image, until

from planegrasp.errors import CameraLostError, InvalidInputError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.cameras import EventKind, NewestFrame, open_camera
from planegrasp.io.cameras.ros2 import Ros2Camera
from planegrasp.io.messages import Header, Stamp
from planegrasp.io.ros2.conversions import camera_info_message
from planegrasp.io.ros2.dds import DdsConfig, DdsNode, dds_type
from planegrasp.io.sources import RecordingTopics


@pytest.fixture
def camera_of(domain):
    """Cameras in the test's domain, each with a node of its own."""
    with ExitStack() as stack:

        def make(topic=COLOR, **options):
            camera = Ros2Camera(topic, node=lambda: DdsNode(DdsConfig(domain)), **options)
            stack.callback(camera.close)
            return camera

        yield make


def frames_with(camera, condition, most=100):
    """Read until a frame fulfils a condition."""
    for _ in range(most):
        frame = camera.read()
        if condition(frame):
            return frame
    raise AssertionError(f"no such frame; {camera.take_reports()}")


@pytest.mark.parametrize(
    ("depth", "encoding", "tolerance"),
    [
        (depth_image(), "32FC1", 0.0),
        (np.rint(1000 * depth_image()).astype(np.uint16), "16UC1", 0.0006),
    ],
)
def test_color_and_depth_of_a_frame(node, camera_of, depth, encoding, tolerance):
    driver = Driver(node, depth=depth, depth_encoding=encoding)
    camera = camera_of()
    with driver.running():
        camera.open()
        assert camera.topics == RecordingTopics(COLOR, DEPTH, INFO)
        frame = frames_with(camera, lambda f: f.depth is not None)
    assert np.array_equal(frame.color, driver.color)
    assert np.abs(frame.depth - depth_image()).max() <= tolerance
    assert frame.camera == CAMERA
    header = camera.header_of(frame)
    assert header.frame_id == "left_optical"
    assert header.stamp.to_seconds() == frame.timestamp
    assert camera.header_of(replace(frame, name="other")) is None
    assert camera.take_reports() == []


@pytest.mark.parametrize(("encoding", "turn"), [("bgr8", True), ("rgba8", False), ("mono8", False)])
def test_encodings_of_color(node, camera_of, encoding, turn):
    expected = color_image()
    sent = expected[:, :, ::-1] if turn else expected
    if encoding == "rgba8":
        sent = np.dstack([expected, expected[:, :, :1]])
    if encoding == "mono8":
        sent = expected[:, :, 0]
        expected = np.repeat(sent[:, :, None], 3, axis=2)
    camera = camera_of()
    with Driver(node, color=sent, encoding=encoding, depth=None).running():
        camera.open()
        assert np.array_equal(camera.read().color, expected)


def test_the_only_camera_without_its_name(node, camera_of):
    camera = camera_of("")
    with Driver(node).running():
        camera.open()
        assert camera.topics.color == COLOR
        camera.read()


def test_compressed_images(node, camera_of):
    topic = f"{COLOR}/compressed"
    writer = node.writer(topic, "sensor_msgs/msg/CompressedImage")
    driver = Driver(node, depth=None)
    camera = camera_of(topic)
    camera.open()
    data = cv2.imencode(".png", driver.color[:, :, ::-1])[1].tobytes()
    header = dds_type("std_msgs/msg/Header")(dds_type("builtin_interfaces/msg/Time")(1, 2), "c")
    for _ in range(20):
        driver.send()
        writer.write(dds_type("sensor_msgs/msg/CompressedImage")(header, "png", data))
        time.sleep(0.01)
    assert np.array_equal(camera.read().color, driver.color)


def test_nobody_publishes(node, camera_of):
    node.writer("/other", "std_msgs/msg/String")
    with pytest.raises(CameraLostError, match=rf"'{COLOR}' for color; domain .* has /other"):
        camera_of().open()
    with pytest.raises(CameraLostError, match="is not open"):
        camera_of().read()


def test_unknown_encoding_is_said_once(node, camera_of):
    camera = camera_of()
    with Driver(node, encoding="yuv422", depth=None).running():
        camera.open()
        with pytest.raises(CameraLostError, match="'yuv422' is none of a colour image"):
            camera.read()
    (report,) = camera.take_reports()
    assert report.startswith(f"{COLOR}: its encoding 'yuv422'")
    assert report.endswith("left out")


def test_camera_info_that_does_not_fit(node, camera_of):
    camera = camera_of()
    other = PinholeCamera(32, 24, 30.0, 30.0, 15.5, 11.5)
    with Driver(node, camera=other, depth=None).running():
        camera.open()
        with pytest.raises(CameraLostError, match="is for 32×24 images, this image is 64×48"):
            camera.read()
    assert len(camera.take_reports()) == 1


def test_camera_without_calibration(node, camera_of):
    """As drivers publish it that were never calibrated: K is 0."""
    info = node.writer(INFO, "sensor_msgs/msg/CameraInfo")
    camera = camera_of()
    with Driver(node, camera=None, depth=None).running():
        camera.open()
        message = camera_info_message(dds_type, Header(Stamp(), ""), CAMERA)
        message.k = [0.0] * 9
        info.write(message)
        with pytest.raises(CameraLostError, match="no camera_info has come"):
            camera.read()
    (report,) = camera.take_reports()
    assert "not calibrated" in report


def test_without_camera_info_a_camera_file_is_needed(node, camera_of):
    with Driver(node, camera=None, depth=None).running():
        with pytest.raises(CameraLostError, match=r"no camera_info for .*: give a camera file"):
            camera_of().open()
        known = camera_of(camera=CAMERA)
        known.open()
        assert known.read().camera == CAMERA


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"depth": depth_image()[:24, :32]}, "depth is 32×24 and colour 64×48"),
        ({"depth_encoding": "8UC4"}, "'8UC4' is none of a depth image"),
        ({"depth": 1000 * depth_image()}, "looks like millimetres"),
    ],
)
def test_depth_that_is_of_no_use(node, camera_of, options, reason):
    camera = camera_of()
    with Driver(node, **options).running():
        camera.open()
        reports = []
        for _ in range(10):
            assert camera.read().depth is None
            reports += camera.take_reports()
    (report,) = reports
    assert reason in report


def test_stamps_that_never_match(node, camera_of):
    camera = camera_of()
    reports = []
    with Driver(node, depth_shift=5.0).running(rate=100.0):
        camera.open()
        for _ in range(100):
            assert camera.read().depth is None
            reports += camera.take_reports()
    (report,) = reports
    assert "never come within 17 ms" in report
    assert "frames go without depth" in report


def test_two_publishers(node, camera_of):
    camera = camera_of()
    first = Driver(node, depth=None)
    second = Driver(node, color=color_image(1), depth=None)
    with first.running():
        camera.open()
        camera.read()
        reports = []
        with second.running():
            for _ in range(30):
                assert np.array_equal(camera.read().color, first.color)
                reports += camera.take_reports()
    assert sorted(reports) == [
        f"more than one publishes on {topic}: only the first is listened to"
        for topic in (INFO, COLOR)
    ]
    with second.running():
        frames_with(camera, lambda frame: np.array_equal(frame.color, second.color))


def test_driver_that_is_restarted(node, camera_of):
    camera = camera_of()
    old = Driver(node)
    with ExitStack() as stack:
        with old.running():
            stream = stack.enter_context(NewestFrame(camera))
            assert stream.next(10.0) is not None
        old.close()
        new = Driver(node, color=color_image(2))
        with new.running():
            for _ in range(500):
                frame = stream.next(10.0)
                if np.array_equal(frame.color, new.color):
                    break
            else:
                raise AssertionError("nothing of the new driver")
            assert stream.losses == 0


def test_driver_that_is_killed(domain, camera_of, start):
    first = start("ros2_driver.py", domain, 0)
    with NewestFrame(camera_of()) as stream:
        assert np.array_equal(stream.next(10.0).color, color_image(0))
        first.kill()
        start("ros2_driver.py", domain, 1)

        def is_new(frame):
            return frame.depth is not None and np.array_equal(frame.color, color_image(1))

        # Topics of a driver are not found at one instant: colour may come alone at first.
        until(lambda: is_new(stream.next(2.0)), seconds=2.0)


def test_reports_are_events_of_the_stream(node, camera_of):
    with Driver(node, depth_encoding="8UC4").running(), NewestFrame(camera_of()) as stream:
        for _ in range(20):
            stream.next(10.0)
        (event,) = stream.take_events()
    assert event.kind is EventKind.SOURCE
    assert "depth is left out" in event.message


def test_names_and_options():
    assert open_camera("ros2:/a/b").name == "ros2:/a/b"
    assert open_camera("ros2", topics=RecordingTopics(depth="")).name == "ros2"
    with pytest.raises(InvalidInputError, match="no name of a ROS topic"):
        open_camera("ros2:image")
    with pytest.raises(InvalidInputError, match="no field of view, size or rate"):
        open_camera("ros2", width=640, height=480)
    with pytest.raises(InvalidInputError, match="for recordings, opencv:0 is a camera"):
        open_camera("opencv:0", topics=RecordingTopics("/a"))
