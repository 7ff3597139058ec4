"""`planegrasp ros2`: images in, detections out, over the loopback interface."""

from __future__ import annotations

import json
import signal
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("cyclonedds")

from rendered_stream import shots, taught
from ros2_driver import COLOR, DEPTH, INFO, Driver, free_domain, until
from ros2_listener import NAME, OUTPUTS, Feed, Listener, nanoseconds, transform
from ros2_proof import Heard, built_peer

from planegrasp.bench.ros2_peer import Endpoint, Peer
from planegrasp.geometry import Rotation
from planegrasp.io.messages import Header, Stamp
from planegrasp.io.recording import open_recorder
from planegrasp.io.ros2.conversions import camera_info_message, image_message
from planegrasp.io.ros2.dds import DdsConfig, DdsNode, dds_type
from planegrasp.io.ros2.dds.as_json import message_to_json
from planegrasp.io.ros2.profiles import TF_STATIC
from planegrasp.library import ObjectLibrary

_MAIN = "from planegrasp.cli import main; main()"


@pytest.fixture
def domain():
    return free_domain()


@pytest.fixture
def node(domain):
    with DdsNode(DdsConfig(domain)) as one:
        yield one


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """A folder with a library and a recording."""
    folder = tmp_path_factory.mktemp("ros2")
    library = ObjectLibrary(folder / "objects")
    library.add(taught()[0])
    library.save()
    with open_recorder(folder / "run") as recorder:
        for shot in shots():
            recorder.write(shot.frame)
    return folder


@pytest.fixture
def start(here, domain):
    """Start the command in a process of its own."""
    begun = []

    def begin(*arguments):
        command = [sys.executable, "-c", _MAIN, "ros2", *map(str, arguments), "--domain", domain]
        process = subprocess.Popen(
            [str(part) for part in command],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=here,
        )
        begun.append(process)
        return process

    yield begin
    for process in begun:
        with process:
            process.kill()


def test_images_in_and_everything_out(node, start):
    feed = Feed(node)
    listener = feed.listener
    start(f"ros2:{COLOR}")
    feed.until(lambda: len(listener.complete()) >= 10)
    for stamp in listener.complete():
        found, shot = listener.by_stamp[stamp], feed.truth[stamp]  # the very stamps that were sent
        (detection,) = found["/planegrasp/detections"].detections
        assert detection.header.frame_id == "left_optical"
        (result,) = detection.results
        assert result.hypothesis.class_id == NAME
        T = transform(result.pose.pose)
        assert np.linalg.norm(T.translation - shot.truth[NAME].translation) < 0.01
        (moved,) = found["/tf"].transforms
        pose = found[f"/planegrasp/objects/{NAME}/pose"]
        assert moved.child_frame_id == f"objects/{NAME}"
        assert moved.header == pose.header == detection.header
        at = pose.pose.pose.position
        assert (moved.transform.translation.x, moved.transform.translation.z) == (at.x, at.z)
        tracked = transform(pose.pose.pose)
        assert np.linalg.norm(tracked.translation - shot.truth[NAME].translation) < 0.01
        C = np.reshape(pose.pose.covariance, (6, 6))
        assert np.all(np.linalg.eigvalsh(C) > 0)
        overlay = found["/planegrasp/overlay"]
        drawn = np.frombuffer(overlay.data, np.uint8).reshape(shot.frame.color.shape)
        share = np.mean(np.any(drawn != shot.frame.color, axis=2))
        assert 0.001 < share < 0.5
        assert {m.ns for m in found["/planegrasp/markers"].markers} == {"boxes", "axes", "names"}


def test_tasks_and_events(node, start):
    feed = Feed(node)
    listener = feed.listener
    process = start(f"ros2:{COLOR}", "--json")
    tasks = node.writer("/planegrasp/task", "std_msgs/msg/String")
    feed.until(lambda: tasks.is_wanted and listener.complete())

    def said():
        return [event["message"] for event in listener.said if event["kind"] == "task"]

    texts = ('{"priorities": {"nobody": 1}}', "{", f'{{"priorities": {{"{NAME}": 3}}}}')
    for number, text in enumerate(texts):
        tasks.write(dds_type("std_msgs/msg/String")(data=text))
        feed.until(lambda n=number: len(said()) > n)
    assert "the task wants 'nobody', which was not taught" in said()[0]
    assert said()[0].endswith("the old one stays")
    assert "the task '{'" in said()[1]
    assert said()[2].startswith(f"{NAME} 3;")
    (added,) = [event for event in listener.said if event["kind"] == "object added"]
    assert (added["name"], added["grasps"]) == (NAME, ["side/flipped"])

    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert process.returncode == 0, err
    result = json.loads(out)
    assert result["stopped"] == "signal"
    assert result["objects"][NAME]["frames"] >= 1
    assert "Traceback" not in err


def test_with_a_camera_and_a_listener_on_another_dds(domain, start):
    """The peer's images in, everything out to the peer, and its task."""
    header = Header(Stamp(1, 0), "left_optical")
    frames = [
        [
            (INFO, camera_info_message(dds_type, header, frame.camera)),
            (DEPTH, image_message(dds_type, header, frame.depth, "32FC1")),
            (COLOR, image_message(dds_type, header, frame.color, "rgb8")),
        ]
        for frame in (shot.frame for shot in shots())
    ]
    image = "sensor_msgs/msg/Image"
    writes = [
        Endpoint(INFO, "sensor_msgs/msg/CameraInfo"),
        Endpoint(DEPTH, image),
        Endpoint(COLOR, image),
        Endpoint("/planegrasp/task", "std_msgs/msg/String"),
    ]
    reads = [Endpoint(topic, kind) for topic, kind in OUTPUTS.items()]
    reads.append(Endpoint("/planegrasp/events", "std_msgs/msg/String", "kept"))
    there_and_back = [*frames, *frames[::-1]]
    with Peer(domain, reads, writes, built_peer()) as peer:
        heard = Heard(peer, reads)
        start(f"ros2:{COLOR}")
        as_json = [[(t, message_to_json(m)) for t, m in one] for one in there_and_back]

        def played(condition):
            before = heard.played
            peer.play(as_json, rate=30.0, count=len(as_json))
            until(lambda: heard.listen(0.05) or heard.played > before)
            return condition()

        until(lambda: played(lambda: all(heard.messages.values())), 60.0)
        peer.write("/planegrasp/task", {"data": "{}"})

        def said():
            events = [json.loads(one.data) for one in heard.messages["/planegrasp/events"]]
            return any(event["kind"] == "task" for event in events)

        until(lambda: played(said), 20.0)
    found = heard.messages["/planegrasp/detections"]
    stamps = {nanoseconds(one.header) for one in found}
    assert len(stamps) == len(found)
    for topic in (f"/planegrasp/objects/{NAME}/pose", "/planegrasp/overlay"):
        assert {nanoseconds(one.header) for one in heard.messages[topic]} <= stamps
    assert {one.header.frame_id for one in found} == {"left_optical"}
    for one in found:
        for detection in one.detections:
            T = transform(detection.results[0].pose.pose)
            assert any(
                np.linalg.norm(T.translation - shot.truth[NAME].translation) < 0.01
                for shot in shots()
            )


def test_a_recording_and_the_frame_of_its_camera(node, start):
    listener = Listener(node)
    static = node.reader("/tf_static", "tf2_msgs/msg/TFMessage", TF_STATIC)
    process = start("run", "--json", "--camera-frame", "eye")
    until(lambda: listener.take() or listener.complete(), 60.0)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert json.loads(out)["stopped"] == "end of the source"
    (stamp, *_) = listener.complete()
    assert listener.by_stamp[stamp]["/planegrasp/detections"].header.frame_id == "eye"
    ((message, _),) = static.take()
    (one,) = message.transforms
    assert (one.header.frame_id, one.child_frame_id) == ("camera_link", "eye")
    q = one.transform.rotation
    # What lies before the lens (optical z) lies before the body (x); right (x) is its -y.
    turn = Rotation.from_quat([q.x, q.y, q.z, q.w])
    assert np.allclose(
        turn.apply([[0, 0, 1], [1, 0, 0], [0, 1, 0]]), [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
    )


def test_a_camera_that_comes_later(node, start):
    process = start(f"ros2:{COLOR}", "--frames", 3, "--json")
    line = process.stderr.readline()
    while "camera lost" not in line:
        assert line
        line = process.stderr.readline()
    assert "trying again until it is there" in line
    with Driver(node, depth=None).running():
        out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    assert json.loads(out)["frames"] == 3
    assert err.count("camera lost") == 0  # once, above


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["ros2:/a b"], "is no name of a ROS topic"),
        (["run", "--network", "eth77"], "cannot use the network interface 'eth77'"),
        (["run", "--namespace", "robot"], "'robot' is no name of a ROS topic"),
        (["run", "--want", "nobody"], "the task wants 'nobody', which was not taught"),
        (["run", "--width", "640", "--height", "480"], "are for cameras, run is none"),
        (["run", "--library", "none"], "no library none"),
    ],
)
def test_what_cannot_be(start, arguments, reason):
    process = start(*arguments)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 1
    assert reason in err
    assert "Traceback" not in err
