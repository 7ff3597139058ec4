"""planegrasp's DDS and another implementation of it understand each other, field by field."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from rendered_stream import processed, shots, taught
from ros2_driver import CAMERA, COLOR, DEPTH, INFO, color_image, depth_image, until
from ros2_examples import messages, plan, refusal
from ros2_proof import Heard, Kept, built_peer

from planegrasp.bench.ros2_peer import Endpoint, Peer
from planegrasp.detector import Detector
from planegrasp.errors import PlanegraspError
from planegrasp.io.cameras.ros2 import Ros2Camera
from planegrasp.io.messages import Header, Stamp, library_events
from planegrasp.io.ros2 import GraspPublisher, LivePublisher
from planegrasp.io.ros2.conversions import camera_info_message, image_message
from planegrasp.io.ros2.dds import dds_type
from planegrasp.io.ros2.dds.as_json import message_to_json
from planegrasp.io.ros2.grasp_conversions import grasp_pose
from planegrasp.io.ros2.task_topic import TaskTopic
from planegrasp.live import Task

KINDS = sorted(messages(dds_type))
NAME = taught()[0].name
IMAGE = "sensor_msgs/msg/Image"
LIVE = (
    Endpoint("/planegrasp/detections", "vision_msgs/msg/Detection3DArray"),
    Endpoint("/planegrasp/markers", "visualization_msgs/msg/MarkerArray"),
    Endpoint("/planegrasp/overlay", IMAGE),
    Endpoint(f"/planegrasp/objects/{NAME}/pose", "geometry_msgs/msg/PoseWithCovarianceStamped"),
    Endpoint("/tf", "tf2_msgs/msg/TFMessage", "tf"),
)
KEPT = (
    Endpoint("/planegrasp/events", "std_msgs/msg/String", "kept"),
    Endpoint("/tf_static", "tf2_msgs/msg/TFMessage", "kept"),
)
GRASPS = (
    *(
        Endpoint(f"/planegrasp/grasp/{part}", "trajectory_msgs/msg/JointTrajectory", "kept")
        for part in ("move", "reach", "lift")
    ),
    *(
        Endpoint(f"/planegrasp/grasp/{part}_pose", "geometry_msgs/msg/PoseStamped", "kept")
        for part in ("pregrasp", "grasp", "object")
    ),
    Endpoint("/planegrasp/grasp/verdicts", "diagnostic_msgs/msg/DiagnosticArray", "kept"),
)


@pytest.fixture(params=["another DDS", "the same DDS"])
def program(request):
    """The peer in Rust on RustDDS, and the one in Python that benchmarks have without it."""
    return built_peer() if request.param == "another DDS" else None


def topic_of(kind, way):
    return f"/{way}/{kind.split('/')[-1].lower()}"


def test_every_type_both_ways(node, domain, program):
    reads = [Endpoint(topic_of(kind, "there"), kind) for kind in KINDS]
    writes = [Endpoint(topic_of(kind, "back"), kind) for kind in KINDS]
    writers = {kind: node.writer(topic_of(kind, "there"), kind) for kind in KINDS}
    readers = {kind: node.reader(topic_of(kind, "back"), kind) for kind in KINDS}
    with Peer(domain, reads, writes, program) as peer:
        heard = Heard(peer, reads)
        for kind, message in messages(dds_type).items():
            until(lambda k=kind: writers[k].is_wanted)
            writers[kind].write(message)
            until(lambda k=kind: heard.listen(0.01) or heard.messages[topic_of(k, "there")])
            assert heard.messages[topic_of(kind, "there")] == [message]

            def sent_back(k=kind, m=message):
                peer.write(topic_of(k, "back"), message_to_json(m))
                time.sleep(0.01)
                return readers[k].take()

            assert all(back == message for back, _ in until(sent_back))


def test_all_that_a_live_system_publishes(node, domain, program):
    detector = Detector(taught())
    frames = [shot.frame for shot in shots()[:6]]
    seen = processed(detector, frames)
    (track,) = seen[-1].tracks
    lost = replace(seen[-1], detections=(), tracks=(), lost=(track,))
    transport = Kept(node)
    publisher = LivePublisher(transport, taught(), body_frame="camera_link")
    publisher.library(library_events((), taught(), Stamp(1, 2)))
    publisher.event("task", "bücher")
    with Peer(domain, (*LIVE, *KEPT), program=program) as peer:
        heard = Heard(peer, (*LIVE, *KEPT))
        # What was published before it came is kept for it.
        until(lambda: heard.listen(0.05) or all(heard.messages[one.topic] for one in KEPT))
        for one in LIVE:
            until(lambda topic=one.topic: transport.writers[topic].is_wanted)
        sent = transport.messages
        for number, one in enumerate([*seen, lost]):
            publisher.publish(one, Header(Stamp(1_700_000_000, number), "left_optical"))
            # The next one could push it out of a writer that keeps only the newest.
            until(lambda: heard.listen(0.05) or lengths(heard.messages) == lengths(sent))
    assert heard.messages == sent
    assert len(sent["/planegrasp/detections"]) == len(seen) + 1
    assert sum(len(one.transforms) for one in sent["/tf"]) >= len(seen) - 1
    assert all(sent.values())


def lengths(by_topic):
    return {topic: len(found) for topic, found in by_topic.items()}


def test_plans_and_refusals(node, domain, program):
    transport = Kept(node)
    publisher = GraspPublisher(transport)
    publisher.publish(plan())
    with Peer(domain, GRASPS, program=program) as peer:
        heard = Heard(peer, GRASPS)
        until(lambda: heard.listen(0.05) or all(heard.messages.values()))
        publisher.publish(refusal())
        until(lambda: heard.listen(0.05) or lengths(heard.messages) == lengths(transport.messages))
    # As texts, in which NaN equals NaN.
    assert repr(heard.messages) == repr(transport.messages)
    last = {topic.split("/")[-1]: found[-1] for topic, found in heard.messages.items()}
    assert last["move"].points == last["reach"].points == last["lift"].points == []
    poses = {part: last[f"{part}_pose"].pose for part in ("pregrasp", "grasp", "object")}
    assert all(np.isnan([p.position.x, p.orientation.w]).all() for p in poses.values())
    first = {topic.split("/")[-1]: found[0] for topic, found in heard.messages.items()}
    assert first["grasp_pose"] == grasp_pose(dds_type, plan().header, plan().gripper_pose)


@pytest.mark.parametrize(
    ("colors", "depth"),
    [
        ("rgb8", "32FC1"),
        ("bgr8", "16UC1"),
    ],
)
def test_frames_of_its_camera(node, domain, program, colors, depth):
    writes = [
        Endpoint(COLOR, IMAGE),
        Endpoint(DEPTH, IMAGE, "sensor"),
        Endpoint(INFO, "sensor_msgs/msg/CameraInfo"),
    ]
    header = Header(Stamp(1, 2), "left_optical")
    metres = depth_image()
    millimetres = np.round(1000 * metres).astype(np.uint16)
    images = {number: color_image(number) for number in range(3)}
    sent = [
        [
            (INFO, camera_info_message(dds_type, header, CAMERA)),
            (
                DEPTH,
                image_message(dds_type, header, metres if depth[0] == "3" else millimetres, depth),
            ),
            (COLOR, image_message(dds_type, header, image, colors)),
        ]
        for image in images.values()
    ]
    frames = [[(topic, message_to_json(message)) for topic, message in one] for one in sent]
    with Peer(domain, (), writes, program) as peer:
        peer.play(frames, rate=30.0, count=1000)
        camera = Ros2Camera(COLOR, node=node)
        camera.open()
        found = set()
        while found < {0, 1, 2, "depth"}:
            frame = camera.read()
            pixels = frame.color if colors == "rgb8" else frame.color[..., ::-1]
            found |= {n for n, image in images.items() if np.array_equal(pixels, image)}
            if frame.depth is not None:
                expected = metres if depth[0] == "3" else millimetres * np.float32(0.001)
                assert np.array_equal(frame.depth, expected)
                found.add("depth")
            assert frame.camera == CAMERA
            assert camera.header_of(frame).frame_id == "left_optical"
            assert abs(camera.header_of(frame).stamp.to_seconds() - time.time()) < 20.0
        camera.close()
        peer.kill()


def test_tasks(node, domain, program):
    tasks = TaskTopic(node, "/planegrasp/task", [NAME], 0.02)
    text = {"data": f'{{"priorities": {{"{NAME}": 3}}, "others": false}}'}
    with Peer(domain, (), [Endpoint("/planegrasp/task", "std_msgs/msg/String")], program) as peer:

        def changed():
            peer.write("/planegrasp/task", text)
            time.sleep(0.01)
            return tasks.changed()

        assert until(changed) == Task({NAME: 3.0}, others=False, budget=0.02)


def test_a_program_that_is_no_peer(domain, tmp_path):
    program = tmp_path / "peer"
    program.write_text("#!/bin/sh\nexit 1\n")
    program.chmod(0o755)
    with pytest.raises(PlanegraspError, match="did not start as a peer"):
        Peer(domain, program=program)
