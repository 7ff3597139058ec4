"""Objects, grasps and cameras where they are, in a log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from foxglove_decoded import assert_equal, matrix, rotation
from mcap_contents import contents
from recorded_frames import frame
from ros2_examples import HEADER, pose

from planegrasp.geometry import RigidTransform
from planegrasp.io.foxglove import DetectionsLog, FoxgloveStream, FoxgloveTopics
from planegrasp.io.messages import (
    FrameIds,
    GraspPlanMessage,
    GraspRefusalMessage,
    GraspVerdict,
    Stamp,
)

TOPICS = FoxgloveTopics()
OPTICAL = "camera_color_optical_frame"


def plan(header):
    verdict = GraspVerdict("side", True, "", 0.9, (("reach", 0.5), ("clearance", 0.02)))
    return GraspPlanMessage(
        header=header,
        name="book",
        grasp="side",
        object_pose=pose(1),
        gripper_pose=pose(2),
        pregrasp_pose=pose(3),
        opening=0.06,
        force=40.0,
        joints=("a", "b"),
        move=((0.0, 1.0), (0.5, 1.5)),
        reach=((0.5, 1.5), (0.6, 1.6)),
        lift=((0.6, 1.6),),
        verdicts=(verdict, replace(verdict, grasp="top", accepted=False, reason="too far")),
    )


def test_grasp_plans_and_refusals(tmp_path):
    header = replace(HEADER, frame_id="base_link")
    planned = plan(header)
    refused = GraspRefusalMessage(header, "book", "out of reach", planned.verdicts[1:])
    with FoxgloveStream() as stream:
        stream.log_to(tmp_path / "run.mcap")
        stream.grasp(planned)
        stream.grasp(refused)
    found = contents(tmp_path / "run.mcap")
    ((time, document),) = found[TOPICS.grasp_plans]
    assert time == header.stamp.total_nanoseconds
    assert_equal(document, planned)
    ((_, document),) = found[TOPICS.grasp_refusals]
    assert_equal(document, refused)
    (_, shown), (_, hidden) = found[TOPICS.grasp_scene]
    (entity,) = shown.entities
    assert (entity.id, entity.frame_id) == ("grasps/book", "base_link")
    poses = [matrix(line.pose) for line in entity.lines]
    np.testing.assert_allclose(poses[0], planned.gripper_pose.T.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(poses[2], planned.pregrasp_pose.T.as_matrix(), atol=1e-12)
    fingers = [(p.x, p.y, p.z) for p in entity.lines[0].points]
    assert fingers[0][1] - fingers[-1][1] == pytest.approx(0.06)
    assert [one.id for one in hidden.deletions] == ["grasps/book"]
    assert not hidden.entities
    said = [message.message for _, message in found[TOPICS.events]]
    assert said == ["grasp: book by 'side'", "no grasp of book: out of reach"]


def test_a_grasp_comes_with_every_frame_while_it_holds(tmp_path):
    planned = plan(replace(HEADER, frame_id="base_link"))
    refused = GraspRefusalMessage(planned.header, "book", "out of reach", ())
    with FoxgloveStream() as stream:
        stream.log_to(tmp_path / "run.mcap")
        stream.detections(frame(0), [])
        stream.grasp(planned)
        stream.detections(frame(1), [])
        stream.grasp(refused)
        stream.detections(frame(2), [])
    (_, first), (time, again), (_, last) = contents(tmp_path / "run.mcap")[TOPICS.grasp_scene]
    assert time == Stamp.from_seconds(frame(1).timestamp).total_nanoseconds
    assert again == first
    assert not last.entities


def test_what_is_gone_is_deleted(watched, tmp_path):
    objects, _, seen = watched
    gone = replace(seen[1], detections=(), tracks=())
    with FoxgloveStream(objects) as stream:
        stream.log_to(tmp_path / "run.mcap")
        for one in (seen[0], gone, seen[2]):
            stream.live(one)
    updates = [message for _, message in contents(tmp_path / "run.mcap")[TOPICS.scene]]
    assert [[e.id for e in update.entities] for update in updates] == [
        [f"objects/{objects[0].name}"],
        [],
        [f"objects/{objects[0].name}"],
    ]
    assert [[e.id for e in update.deletions] for update in updates] == [
        [],
        [f"objects/{objects[0].name}"],
        [],
    ]


def test_headers_of_the_source_and_a_moving_camera(watched, tmp_path):
    _, _, seen = watched
    T_base_camera = pose(7).T
    with FoxgloveStream(ids=FrameIds(fixed="base_link")) as stream:
        stream.log_to(tmp_path / "run.mcap")
        stream.live(seen[0], HEADER, T_base_camera)
        stream.live(seen[1], None, T_base_camera)
    found = contents(tmp_path / "run.mcap")
    assert found[TOPICS.color][0][0] == HEADER.stamp.total_nanoseconds
    (_, theirs), (_, ours) = found[TOPICS.transforms]
    chain = [(t.parent_frame_id, t.child_frame_id) for t in theirs.transforms]
    assert chain[0] == ("base_link", OPTICAL), "their camera has a body of its own"
    assert chain[1][0] == "base_link"
    chain = [(t.parent_frame_id, t.child_frame_id) for t in ours.transforms]
    assert chain[:2] == [("camera_link", OPTICAL), ("base_link", "camera_link")]
    whole = np.eye(4)
    for one in (ours.transforms[1], ours.transforms[0]):
        p = one.translation
        step = RigidTransform.from_components([p.x, p.y, p.z], rotation(one.rotation))
        whole = whole @ step.as_matrix()
    np.testing.assert_allclose(whole, T_base_camera.as_matrix(), atol=1e-12)


def test_detections_without_tracks(watched, tmp_path):
    objects, detector, seen = watched
    found = detector.detect(seen[0].frame)
    with DetectionsLog(tmp_path / "run.mcap", objects) as log:
        log.write(seen[0].frame, found)
    logged = contents(tmp_path / "run.mcap")
    assert TOPICS.tracks not in logged
    ((_, transforms),) = logged[TOPICS.transforms]
    placed = transforms.transforms[1].translation
    T = found[0].pose.T_camera_object
    np.testing.assert_allclose([placed.x, placed.y, placed.z], T.translation, atol=1e-15)
