"""What planegrasp found, as values for others."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rendered_stream import processed, shots, taught
from scipy.spatial.transform import Rotation

from planegrasp.body import BoxBody
from planegrasp.detector import Detector
from planegrasp.errors import InvalidInputError, UnknownObjectError
from planegrasp.geometry import RigidTransform
from planegrasp.grasping import CanonicalGrasp
from planegrasp.grasping.plan import GraspAssessment, GraspPlan, GraspRefusal
from planegrasp.io.messages import (
    FrameIds,
    Header,
    LibraryEventKind,
    Pose,
    Stamp,
    detections_message,
    grasp_message,
    library_events,
    live_messages,
    parent_covariance,
    task_from_json,
    task_to_json,
    tracks_message,
)
from planegrasp.live import Task
from planegrasp.objects import ObjectModel
from planegrasp.robot.path import Path

HEADER = Header(Stamp(12, 34), "camera")


@given(st.integers(0, 2**31 * 10**9 - 1))
def test_stamp_of_nanoseconds_and_back(nanoseconds):
    stamp = Stamp.from_nanoseconds(nanoseconds)
    assert stamp.total_nanoseconds == nanoseconds
    assert abs(stamp.to_seconds() - nanoseconds / 1e9) < 1e-6


def test_stamp_is_the_nearest_nanosecond():
    assert Stamp.from_seconds(1.9999999996) == Stamp(2, 0)
    assert Stamp.from_seconds(0.1) == Stamp(0, 100_000_000)
    exact = Stamp.from_seconds(1_700_000_000.123456789)
    assert abs(exact.nanoseconds - 123_456_789) < 250  # what a float holds at this date
    assert exact.to_seconds() == 1_700_000_000.123456789
    assert Stamp.from_seconds(None) == Stamp(0, 0)


@pytest.mark.parametrize("seconds", [-1e-3, float("nan"), float("inf"), 2.0**31])
def test_stamp_that_cannot_be(seconds):
    with pytest.raises(InvalidInputError, match="stamp"):
        Stamp.from_seconds(seconds)


def test_names_of_frames():
    ids = FrameIds()
    assert ids.object("book") == "objects/book"
    assert ids.object("book", 2) == "objects/book/2"
    with pytest.raises(InvalidInputError, match="slash"):
        FrameIds(camera="/camera")
    with pytest.raises(InvalidInputError, match="needs a name"):
        FrameIds(camera="")


def test_pose_of_a_transform_and_points_in_it():
    rng = np.random.default_rng(7)
    turns = [*Rotation.random(50, rng=rng), *Rotation.from_rotvec(np.pi * np.eye(3))]
    for turn in turns:
        T = RigidTransform.from_components(rng.uniform(-2, 2, 3), turn)
        pose, point = Pose.of(T), tuple(rng.uniform(-1, 1, 3).tolist())
        assert pose.orientation[3] >= 0
        assert np.allclose(pose.T.as_matrix(), T.as_matrix(), atol=1e-12)
        assert np.allclose(pose.apply(point), T.apply(point), atol=1e-12)


def test_covariance_is_that_of_samples_in_the_parent_frame():
    """Poses T·δ with δ as planegrasp has it scatter in the parent frame as ROS would have it."""
    rng = np.random.default_rng(3)
    T = RigidTransform.from_components([0.3, -0.2, 0.8], Rotation.from_rotvec([0.9, -0.5, 1.1]))
    root = rng.normal(size=(6, 6)) * np.array([3, 1, 2, 5, 2, 1])[:, None] * 1e-3
    covariance = root @ root.T
    deltas = rng.multivariate_normal(np.zeros(6), covariance, size=200_000)
    moved = T * RigidTransform.from_components(deltas[:, :3], Rotation.from_rotvec(deltas[:, 3:]))
    translations = moved.translation - T.translation
    turns = (moved.rotation * T.rotation.inv()).as_rotvec()
    sampled = np.cov(np.hstack([translations, turns]).T)
    expected = parent_covariance(T, covariance)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.abs((sampled - expected) / scale).max() < 0.02
    assert np.abs((covariance - expected) / scale).max() > 0.2  # else the test could not tell


@pytest.fixture(scope="module")
def seen():
    """The last live frame of a short stream of three objects."""
    frames = [shot.frame for shot in shots(3, 5)]
    return processed(Detector(taught(3)), frames)[-1]


def test_detections_of_a_live_frame(seen):
    message = detections_message(seen.detections, HEADER, seen.tracks)
    assert message.header == HEADER
    assert len(message.objects) == len(seen.detections) == 3
    numbers = {track.name: track.number for track in seen.tracks}
    for shown, detection in zip(message.objects, seen.detections, strict=True):
        assert shown.track == numbers[shown.name]
        assert shown.tracked is detection.tracked
        assert np.allclose(shown.corners, detection.corners)
        assert np.allclose(
            shown.pose.pose.T.as_matrix(), detection.T_camera_object.as_matrix(), atol=1e-12
        )
        R = detection.T_camera_object.rotation.as_matrix()
        C = np.reshape(shown.pose.covariance, (6, 6))
        assert np.allclose(C[:3, 3:], R @ detection.covariance[:3, 3:] @ R.T)
        assert shown.box.size == detection.model.outer_body.size
    assert message == detections_message(seen.detections, HEADER, seen.tracks)


def test_tracks_of_a_live_frame(seen):
    message = tracks_message(seen.tracks, HEADER, lost=seen.tracks[:1])
    assert message.lost == (seen.tracks[0].number,)
    assert len(message.objects) == len(seen.tracks) == 3
    for shown, track in zip(message.objects, seen.tracks, strict=True):
        filtered, pose = track.filtered, track.detection.pose
        assert shown.seen
        assert np.allclose(shown.pose.pose.T.as_matrix(), filtered.T_base_object.as_matrix())
        assert np.allclose(shown.twist.linear, filtered.linear_velocity)
        assert np.allclose(np.reshape(shown.twist.covariance, (6, 6)), filtered.covariance[6:, 6:])
        shared = parent_covariance(filtered.T_base_object, pose.covariance - pose.noise_covariance)
        C = np.reshape(shown.pose.covariance, (6, 6))
        assert np.allclose(C, filtered.covariance[:6, :6] + shared)
        assert np.all(np.linalg.eigvalsh(C) > 0)
    hidden = replace(seen.tracks[0], detection=None, reason="hidden")
    unseen = tracks_message([hidden], HEADER).objects[0]
    assert not unseen.seen
    assert unseen.reason == "hidden"
    C = np.reshape(unseen.pose.covariance, (6, 6))
    assert np.allclose(C, seen.tracks[0].filtered.covariance[:6, :6])


def test_messages_of_a_live_frame_have_its_stamp_and_frames(seen):
    stamp = Stamp.from_seconds(seen.frame.timestamp)
    detections, tracks = live_messages(seen)
    assert detections.header == tracks.header == Header(stamp, "camera_color_optical_frame")
    detections, tracks = live_messages(seen, FrameIds(fixed="base_link"), HEADER)
    assert (detections.header, tracks.header) == (HEADER, Header(HEADER.stamp, "base_link"))


def test_detection_without_pose(seen):
    detection = replace(seen.detections[0], pose=None, pose_failure="no depth")
    (shown,) = detections_message([detection], HEADER).objects
    assert shown.pose is None
    assert shown.pose_failure == "no depth"
    assert shown.track is None


def test_other_solution_of_an_ambiguous_pose(seen):
    detection = seen.detections[0]
    other = RigidTransform.from_translation([0.1, 0.2, 0.3])
    pose = replace(detection.pose, ambiguous=True, alternative=other, covariance=None)
    (shown,) = detections_message([replace(detection, pose=pose)], HEADER).objects
    assert shown.alternative == Pose((0.1, 0.2, 0.3), (0.0, 0.0, 0.0, 1.0))
    assert shown.pose.covariance is None
    clear = replace(detection, pose=replace(pose, ambiguous=False))
    assert detections_message([clear], HEADER).objects[0].alternative is None


def test_plan_and_refusal():
    at = RigidTransform.from_translation([0.5, 0.0, 0.4])
    grasp = CanonicalGrasp("side", RigidTransform.from_translation([0.1, 0.0, 0.0]), 0.06)
    verdict = GraspAssessment("side", True, score=0.8, figures={"clearance": 0.01, "far": np.inf})
    path = Path(np.array([[0.0, 1.0], [0.5, 1.5]]))
    plan = GraspPlan("book", grasp, at, at, at, path, path, path, 0.06, 40.0, (verdict,), {})
    message = grasp_message(plan, HEADER, ("shoulder", "elbow"))
    assert message.move == ((0.0, 1.0), (0.5, 1.5))
    assert message.joints == ("shoulder", "elbow")
    assert message.gripper_pose.position == (0.5, 0.0, 0.4)
    assert message.verdicts[0].figures == (("clearance", 0.01),)
    refused = GraspAssessment("side", False, "out of reach by 0.2 m")
    refusal = grasp_message(GraspRefusal("book", "nothing works", (refused,)), HEADER)
    assert (refusal.name, refusal.reason) == ("book", "nothing works")
    assert refusal.verdicts[0].reason == "out of reach by 0.2 m"


def test_task_there_and_back():
    task = Task({"book": 2.0}, others=False, budget=0.01)
    assert task_from_json(task_to_json(task), ["book"]) == task
    assert task_from_json("{}", ["book"], default_budget=0.04) == Task(budget=0.04)
    for text, reason in (
        ("{", "the task '{'"),
        ("[]", "input should be a valid dictionary"),
        ('{"priority": {}}', "priority: extra inputs are not permitted"),
        ('{"priorities": {"book": "high"}}', "priorities.book: input should be a valid number"),
        ('{"budget": 0}', "must be > 0 s, got 0"),
    ):
        with pytest.raises(InvalidInputError, match=re.escape(reason)):
            task_from_json(text, ["book"])
    with pytest.raises(UnknownObjectError, match="'box', which was not taught; there are book"):
        task_from_json('{"priorities": {"box": 1}}', ["book"])


def test_library_events(photo):
    image = photo("coffee", width=80)
    book, box = (ObjectModel.from_image(name, image, width=0.2) for name in ("book", "box"))
    now = Stamp(5)
    added = library_events([], [book, box], now)
    assert [(e.kind, e.name) for e in added] == [
        (LibraryEventKind.ADDED, "book"),
        (LibraryEventKind.ADDED, "box"),
    ]
    assert added[0].faces[0].width == 0.2
    assert library_events([book, box], [box, book], now) == ()
    grasp = CanonicalGrasp("side", RigidTransform.identity(), 0.06)
    for changed in (
        replace(book, priority=2),
        replace(book, body=BoxBody((0.2, 0.1, 0.1))),
        replace(book, grasps=[grasp]),
        ObjectModel.from_image("book", image[:, ::-1], width=0.2),
    ):
        (event,) = library_events([book, box], [changed, box], now)
        assert (event.kind, event.name) == (LibraryEventKind.CHANGED, "book")
    (gone,) = library_events([book, box], [box], now)
    assert (gone.kind, gone.name, gone.stamp) == (LibraryEventKind.REMOVED, "book", now)
