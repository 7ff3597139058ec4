"""The ROS 2 package, against a stand-in for rclpy where there is no ROS."""

from __future__ import annotations

import json
import sys
import threading
import tomllib
import xml.etree.ElementTree as ET
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags")

import stand_in_for_ros
from rendered_stream import shots, taught
from ros2_driver import COLOR, DEPTH, Driver, until
from ros2_examples import messages
from ros2_types import typestore

from planegrasp.library import ObjectLibrary

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "ros2" / "planegrasp_ros"
NAME = taught()[0].name


@pytest.fixture(scope="module")
def package():
    """The modules of the package, with the stand-in imported in place of ROS."""
    before, path = dict(sys.modules), list(sys.path)
    stand_in_for_ros.install(typestore())
    sys.path.insert(0, str(PACKAGE))
    import planegrasp_ros.live_node
    import planegrasp_ros.rclpy_transport

    yield planegrasp_ros
    sys.path[:] = path
    for name in set(sys.modules) - set(before):
        if name.startswith(("rclpy", "rosidl_runtime_py", "planegrasp_ros")):
            del sys.modules[name]


def test_messages_are_made_as_rosidl_wants_them(package):
    made = messages(package.rclpy_transport.ros_type)
    assert bytes(made["sensor_msgs/msg/Image"].data)
    assert made["sensor_msgs/msg/CameraInfo"].d.typecode == "d"
    assert len(made["visualization_msgs/msg/MarkerArray"].markers) == 9


def test_the_node_finds_and_publishes(package, tmp_path):
    library = ObjectLibrary(tmp_path)
    library.add(taught()[0])
    library.save()
    stand_in_for_ros.Node.parameters = {"library": str(tmp_path)}
    node, other = stand_in_for_ros.Node("planegrasp"), stand_in_for_ros.Node("camera")
    ros = package.rclpy_transport.RclpyTransport(other)
    driver = Driver(ros, depth=shots()[0].frame.depth, camera=shots()[0].frame.camera)
    kinds = {
        "/planegrasp/detections": "vision_msgs/msg/Detection3DArray",
        f"/planegrasp/objects/{NAME}/pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
        "/planegrasp/markers": "visualization_msgs/msg/MarkerArray",
        "/planegrasp/overlay": "sensor_msgs/msg/Image",
        "/tf": "tf2_msgs/msg/TFMessage",
    }
    readers = {topic: ros.reader(topic, kind) for topic, kind in kinds.items()}
    events = ros.reader("/planegrasp/events", "std_msgs/msg/String")
    tasks = ros.writer("/planegrasp/task", "std_msgs/msg/String")
    stop = threading.Event()
    running = threading.Thread(target=package.live_node.run, args=(node, stop))
    running.start()
    got, truth, said = {}, {}, []
    stream = cycle([*shots(), *shots()[::-1]])

    def sent(condition):
        shot = next(stream)
        header = driver.send_frame(shot.frame)
        truth[header.stamp.nanoseconds] = shot
        for topic, reader in readers.items():
            for message, _ in reader.take():
                got[topic] = message
        said.extend(json.loads(message.data) for message, _ in events.take())
        return condition()

    try:
        until(lambda: sent(lambda: len(got) == len(kinds)) or stop.wait(1 / 30), 60.0)
        tasks.write(ros.types("std_msgs/msg/String")(data='{"priorities": {"nobody": 1}}'))
        until(lambda: sent(lambda: any(one["kind"] == "task" for one in said)), 20.0)
    finally:
        stop.set()
        running.join(20.0)
        ros.close()
    pose = got[f"/planegrasp/objects/{NAME}/pose"]
    assert pose.header.frame_id == "left_optical"
    at = pose.pose.pose.position
    expected = truth[pose.header.stamp.nanosec].truth[NAME].translation
    assert np.linalg.norm(np.subtract([at.x, at.y, at.z], expected)) < 0.02
    assert any(f"found: {NAME}" in line for line in node.logged)
    assert node.get_topic_names_and_types() == []  # all that was made is gone


def test_what_is_published_by_others(package):
    node, other = stand_in_for_ros.Node("a"), stand_in_for_ros.Node("b")
    own = package.rclpy_transport.RclpyTransport(node)
    theirs = package.rclpy_transport.RclpyTransport(other)
    with own, theirs:
        own.writer("/own", "std_msgs/msg/String")
        Driver(theirs)
        found = own.published()
        assert "/own" not in found
        assert found[COLOR].message == "sensor_msgs/msg/Image"
        assert found[DEPTH].reliable
        reader = own.reader(COLOR, "sensor_msgs/msg/Image")
        waiting = own.waiting([reader])
        assert not waiting.wait(0.01)
        assert reader.publishers == 1


def test_the_package_and_planegrasp_have_one_version():
    cargo = tomllib.loads((ROOT / "Cargo.toml").read_text())
    version = cargo["workspace"]["package"]["version"]
    assert ET.parse(PACKAGE / "package.xml").findtext("version") == version
    assert f'version="{version}"' in (PACKAGE / "setup.py").read_text()


def test_the_parameters_have_these_names_and_types(package):
    text = (PACKAGE / "config" / "planegrasp.yaml").read_text()
    named = [line.strip().partition(":")[0] for line in text.splitlines()[2:] if "#" not in line]
    assert named == list(package.live_node.PARAMETERS)
