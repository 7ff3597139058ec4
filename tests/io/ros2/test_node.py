"""Processes that exchange messages over the loopback interface."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest
from ros2_driver import until
from ros2_echo import topic_of
from ros2_examples import messages

from planegrasp.errors import InvalidInputError, NetworkError
from planegrasp.io.ros2.dds import DdsConfig, DdsNode, dds_type
from planegrasp.io.ros2.names import check_topic, dds_topic, ros_topic, topic_parts
from planegrasp.io.ros2.profiles import KEPT, SENSOR


def test_every_type_there_and_back(node, domain, start):
    start("ros2_echo.py", domain)
    expected = messages(dds_type)
    ways = {
        kind: (node.writer(topic_of(kind, "in"), kind), node.reader(topic_of(kind, "out"), kind))
        for kind in expected
    }
    for kind, (writer, reader) in ways.items():
        until(lambda w=writer, r=reader: w.is_wanted and r.publishers)
        writer.write(expected[kind])
        ((message, publisher),) = until(reader.take)
        assert message == expected[kind], kind
        assert reader.publisher_is_there(publisher)
        assert writer.refused == 0


def test_peer_that_was_killed_receives_again(node, domain, start):
    kind = "std_msgs/msg/String"
    writer = node.writer(topic_of(kind, "in"), kind)
    reader = node.reader(topic_of(kind, "out"), kind)
    image = node.writer("/in/image", "sensor_msgs/msg/Image")
    large = messages(dds_type)["sensor_msgs/msg/Image"]
    large.data = bytes(1_000_000)
    for run in range(3):
        process = start("ros2_echo.py", domain)
        sent = dds_type(kind)(data=f"run {run}")

        def echoed(sent=sent):
            writer.write(sent)
            return any(message == sent for message, _ in reader.take())

        until(echoed, seconds=2.0)
        process.send_signal(signal.SIGKILL if run else signal.SIGSTOP)
        for _ in range(10):  # nobody takes these
            assert writer.write(sent)
            assert image.write(large)


def test_who_comes_late_gets_what_is_kept(node, domain):
    kind = "std_msgs/msg/String"
    kept, gone = node.writer("/kept", kind, KEPT), node.writer("/gone", kind)
    assert kept.is_wanted
    assert not gone.is_wanted
    for text in ("a", "b"):
        kept.write(dds_type(kind)(data=text))
        gone.write(dds_type(kind)(data=text))
    with DdsNode(DdsConfig(domain)) as other:
        late, missed = other.reader("/kept", kind, KEPT), other.reader("/gone", kind)
        until(lambda: missed.publishers)
        received = []
        until(lambda: received.extend(late.take()) or len(received) == 2)
        assert [message.data for message, _ in received] == ["a", "b"]
        assert missed.take() == []


def test_what_others_publish(node, domain):
    node.writer("/own", "std_msgs/msg/String")
    with DdsNode(DdsConfig(domain)) as other:
        other.writer("/a/color", "sensor_msgs/msg/Image", SENSOR)
        other.writer("/a/camera_info", "sensor_msgs/msg/CameraInfo")
        published = until(lambda: len(p := node.published()) == 2 and p)
        assert published["/a/color"].message == "sensor_msgs/msg/Image"
        assert not published["/a/color"].reliable
        assert published["/a/camera_info"].reliable
    until(lambda: not node.published())


def test_domains_do_not_mix(node, domain):
    kind = "std_msgs/msg/String"
    reader = node.reader("/x", kind)
    with DdsNode(DdsConfig(domain + 100)) as other:
        writer = other.writer("/x", kind)
        time.sleep(0.3)
        assert not writer.is_wanted
        assert not reader.publishers


def test_network_interface_that_is_not_there(domain):
    with pytest.raises(
        NetworkError, match=r"'eth77' in domain \d+: name one that is up \(.*\blo\b"
    ):
        DdsNode(DdsConfig(domain, "eth77"))
    with pytest.raises(InvalidInputError, match="no network interface is named"):
        DdsConfig(0, 'lo"/>')


def test_no_network_interface_at_all():
    """As in a container without network: even the loopback interface is down."""
    alone = ["unshare", "--map-root-user", "--net"]
    try:
        subprocess.run([*alone, "true"], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("this system has no network namespaces")
    code = (
        "from planegrasp.io.ros2.dds import DdsConfig, DdsNode\n"
        "from planegrasp.errors import NetworkError\n"
        "for network in ('', 'auto', 'lo'):\n"
        "    try:\n"
        "        DdsNode(DdsConfig(1, network))\n"
        "    except NetworkError as error:\n"
        "        print(error)\n"
    )
    run = [*alone, sys.executable, "-c", code]
    lines = subprocess.run(run, check=True, capture_output=True, text=True).stdout.splitlines()
    ending = " in domain 1: none is up, not even lo (ip link set lo up)"
    wanted = ("the loopback interface", "any network interface", "the network interface 'lo'")
    assert lines == [f"DDS cannot use {one}{ending}" for one in wanted]


def test_another_reason_than_the_network(domain, monkeypatch):
    monkeypatch.setenv("CYCLONEDDS_URI", "<CycloneDDS><nonsense/></CycloneDDS>")
    with pytest.raises(
        NetworkError,
        match=r"any network interface in domain \d+, with the configuration that CYCLONEDDS_URI "
        r"names: \[DDS_RETCODE_ERROR\] .*DomainParticipant$",
    ):
        DdsNode(DdsConfig(domain, "auto"))


def test_interface_by_name(domain):
    with DdsNode(DdsConfig(domain, "lo")) as one:
        assert one.published() == {}


def test_configuration(monkeypatch):
    assert 'address="127.0.0.1"' in DdsConfig().xml
    assert DdsConfig.from_environment({}) == DdsConfig(0, "")
    variables = {"ROS_DOMAIN_ID": "7", "ROS_AUTOMATIC_DISCOVERY_RANGE": "localhost"}
    assert DdsConfig.from_environment(variables) == DdsConfig(7, "")
    variables["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "SUBNET"
    assert DdsConfig.from_environment(variables) == DdsConfig(7, "auto")
    with pytest.raises(InvalidInputError, match="ROS_DOMAIN_ID must be a number, got 'x'"):
        DdsConfig.from_environment({"ROS_DOMAIN_ID": "x"})
    with pytest.raises(InvalidInputError, match="0 … 232, got 233"):
        DdsConfig(233)
    monkeypatch.delenv("CYCLONEDDS_URI", raising=False)
    assert "autodetermine" in DdsConfig(0, "auto").xml
    monkeypatch.setenv("CYCLONEDDS_URI", "file:///somewhere.xml")
    assert DdsConfig(0, "auto").xml is None
    assert 'address="127.0.0.1"' in DdsConfig().xml  # never onto the network unasked


@pytest.mark.parametrize(
    "name", ["", "a", "/", "/a/", "/a//b", "/1a", "/a-b", "/a__b", "~/a", "/ä"]
)
def test_names_that_ros_does_not_take(name):
    with pytest.raises(InvalidInputError, match="no name of a ROS topic"):
        check_topic(name)


def test_names_of_topics():
    assert dds_topic("/camera/color/image_raw") == "rt/camera/color/image_raw"
    assert ros_topic("rt/tf") == "/tf"
    assert ros_topic("rq/service") is None
    parts = topic_parts(["a-b", "a_b", "a.b", "9x", "-", "a__b"])
    assert len(set(parts.values())) == 6
    assert parts["9x"] == "object_9x"
    for part in parts.values():
        check_topic(f"/{part}")
    assert topic_parts(reversed(list(parts))) == parts
