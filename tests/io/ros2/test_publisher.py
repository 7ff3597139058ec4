"""What a live system publishes, object by object."""

from __future__ import annotations

from dataclasses import replace

import pytest
from rendered_stream import processed, shots, taught
from ros2_driver import until

from planegrasp.detector import Detector
from planegrasp.errors import InvalidInputError
from planegrasp.io.messages import FrameIds
from planegrasp.io.ros2 import LivePublisher, LiveTopics
from planegrasp.io.ros2.dds import DdsConfig, DdsNode

_POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
NAME = taught()[0].name


@pytest.fixture(scope="module")
def seen():
    """A live frame with one object."""
    return processed(Detector(taught()), [shot.frame for shot in shots(frames=24)[:3]])[-1]


@pytest.fixture
def other(domain):
    with DdsNode(DdsConfig(domain)) as second:
        yield second


def test_instances_have_topics_of_their_own(node, other, seen):
    publisher = LivePublisher(node, taught())
    (track,) = seen.tracks
    both = replace(seen, tracks=(track, replace(track, number=9, instance=1)))
    readers = [
        other.reader(f"/planegrasp/objects/{NAME}/{part}pose", _POSE)
        for part in ("", "instance_1/")
    ]
    frames = other.reader("/tf", "tf2_msgs/msg/TFMessage")
    for reader in readers:
        until(lambda r=reader: publisher.publish(both) or r.take())
    ((message, _), *_) = until(frames.take)
    children = [one.child_frame_id for one in message.transforms]
    assert children == [f"objects/{NAME}", f"objects/{NAME}/1"]


def test_what_is_not_seen_is_not_published(node, other, seen):
    publisher = LivePublisher(node, taught())
    reader = other.reader(f"/planegrasp/objects/{NAME}/pose", _POSE)
    frames = other.reader("/tf", "tf2_msgs/msg/TFMessage")
    found = other.reader("/planegrasp/detections", "vision_msgs/msg/Detection3DArray")
    until(lambda: found.publishers and reader.publishers and frames.publishers)
    hidden = replace(seen.tracks[0], detection=None, reason="hidden")
    empty = replace(seen, detections=(), tracks=(hidden,))
    (message, _), *_ = until(lambda: publisher.publish(empty) or found.take())
    assert message.detections == []
    assert reader.take() == frames.take() == []


def test_names_that_ros_does_not_take(node, other, seen):
    models = [replace(taught()[0], name=name) for name in ("a-b", "a.b", "1st")]
    LivePublisher(node, models, FrameIds(), LiveTopics("/robot/eyes"))
    published = until(lambda: len(found := other.published()) > 6 and found)
    parts = [topic.split("/")[4] for topic in published if topic.endswith("/pose")]
    assert sorted(parts) == ["a_b", "a_b_2", "object_1st"]
    with pytest.raises(InvalidInputError, match="no name of a ROS topic"):
        LiveTopics("robot")


def test_topics_are_gone_when_it_is_closed(node, other):
    with LivePublisher(node, taught(), body_frame="camera_link"):
        until(lambda: "/tf_static" in other.published())
    until(lambda: other.published() == {})
