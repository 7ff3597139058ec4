"""What goes over the wire, byte by byte, against rosbags' own serialisation."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("cyclonedds")
pytest.importorskip("rosbags")

from ros2_examples import HEADER, detections, messages, tracks
from ros2_types import same, types_of, typestore
from rosbags.typesys import Stores

from planegrasp.errors import InvalidInputError
from planegrasp.io.ros2.conversions import UNKNOWN_COVARIANCE, image_message
from planegrasp.io.ros2.dds.types import dds_type, ros_name

KINDS = sorted(messages(dds_type))


@pytest.fixture(scope="module", params=[Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY])
def store(request):
    return typestore(request.param)


@pytest.mark.parametrize("kind", KINDS)
def test_bytes_are_those_of_rosbags(store, kind):
    ours = messages(dds_type)[kind]
    theirs = messages(types_of(store))[kind]
    sent = bytes(store.serialize_cdr(theirs, kind))
    assert ours.serialize() == sent
    assert same(store.deserialize_cdr(ours.serialize(), kind), ours)
    read = dds_type(kind).deserialize(sent)
    assert read == ours


@pytest.mark.parametrize("kind", ["sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"])
@pytest.mark.parametrize("text", ["", "a", "ab", "abc", "abcd"])
def test_images_whatever_the_alignment(store, kind, text):
    message = messages(dds_type)[kind]
    message.header.frame_id = text
    for member in ("encoding", "format"):
        if hasattr(message, member):
            setattr(message, member, text + "x")
    for count in (0, 1, 5):
        message.data = bytes(range(count))
        again = store.deserialize_cdr(message.serialize(), kind)
        assert bytes(again.data) == message.data
        assert dds_type(kind).deserialize(message.serialize()) == message


@pytest.mark.parametrize("text", ["", "a", "ab", "abc", "abcd", "abcde", "abcdef", "abcdefg"])
@pytest.mark.parametrize("coefficients", [0, 1, 5])
def test_camera_infos_whatever_the_alignment(store, text, coefficients):
    kind = "sensor_msgs/msg/CameraInfo"
    theirs = messages(types_of(store))[kind]
    theirs.header.frame_id, theirs.distortion_model = text, text[::-1] + "x"
    theirs.d = np.arange(coefficients) / 7
    for little in (True, False):
        sent = bytes(store.serialize_cdr(theirs, kind, little_endian=little))
        assert same(theirs, dds_type(kind).deserialize(sent))


@pytest.mark.parametrize("kind", ["sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"])
def test_big_endian_senders_are_understood(store, kind):
    theirs = messages(types_of(store))[kind]
    big = bytes(store.serialize_cdr(theirs, kind, little_endian=False))
    assert big[1] == 0
    assert dds_type(kind).deserialize(big) == messages(dds_type)[kind]


def test_names_of_types():
    for kind in KINDS:
        typename = dds_type(kind).__idl_typename__
        package, _, name = kind.split("/")
        assert typename == f"{package}::msg::dds_::{name}_"
        assert ros_name(typename) == kind
    assert ros_name("Something") == "Something"
    with pytest.raises(InvalidInputError, match="no message is named 'a/msg/B'"):
        dds_type("a/msg/B")


def test_detections_in_vision_msgs():
    message = messages(dds_type)["vision_msgs/msg/Detection3DArray"]
    first, second = message.detections  # the third has no pose
    known, unsure, _ = detections().objects
    assert (first.id, second.id) == ("7", "")
    assert [r.hypothesis.class_id for r in second.results] == ["box", "box"]
    assert first.results[0].pose.covariance == list(known.pose.covariance)
    assert second.results[0].pose.covariance == list(UNKNOWN_COVARIANCE)
    assert second.results[1].pose.pose.position.x == unsure.alternative.position[0]
    centre = known.pose.pose.T.apply([0.0, 0.01, -0.02])
    at = first.bbox.center.position
    assert np.allclose([at.x, at.y, at.z], centre)
    size = first.bbox.size
    assert (size.x, size.y, size.z) == (0.2, 0.3, 0.04)
    assert message.header.stamp.nanosec == HEADER.stamp.nanoseconds


def test_markers_of_seen_hidden_and_lost():
    markers = messages(dds_type)["visualization_msgs/msg/MarkerArray"].markers
    actions = {(marker.id, marker.ns): marker.action for marker in markers}
    parts = ("boxes", "axes", "names")
    expected = ((7, 0), (8, 2), (3, 2))
    assert actions == {(number, part): action for number, action in expected for part in parts}
    box, axes, name = markers[:3]
    (seen, _) = tracks().objects
    assert (box.scale.x, box.scale.y, box.scale.z) == seen.box.size
    assert axes.pose.position.x == seen.pose.pose.position[0]
    assert len(axes.points) == len(axes.colors) == 6
    assert axes.colors[0].r > axes.colors[0].b
    assert name.text == "book #2"
    assert all(marker.lifetime.sec == 1 for marker in markers)


def test_image_of_any_layout():
    pixels = np.arange(60, dtype=">u2").reshape(4, 15)[:, ::3]
    message = image_message(dds_type, HEADER, pixels, "16UC1")
    assert (message.width, message.height, message.step, message.is_bigendian) == (5, 4, 10, 0)
    assert np.array_equal(np.frombuffer(message.data, "<u2").reshape(4, 5), pixels)
