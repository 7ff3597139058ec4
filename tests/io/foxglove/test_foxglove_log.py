"""What is in a log, read by mcap's reader with the schemas in the file."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from foxglove_decoded import assert_equal, matrix, rotation, stamp_of
from mcap_contents import contents, schemas
from ros2_examples import plan

from planegrasp.geometry import RigidTransform
from planegrasp.io.foxglove import FoxgloveStream, FoxgloveTopics
from planegrasp.io.foxglove.documents import document_of, schema_of
from planegrasp.io.messages import (
    DetectionsMessage,
    GraspPlanMessage,
    LibraryEvent,
    Stamp,
    TracksMessage,
    library_events,
    live_messages,
)
from planegrasp.io.messages.frames import OPTICAL_IN_BODY
from planegrasp.undistorted import Undistorted
from planegrasp.viz.geometry import axis_ends

TOPICS = FoxgloveTopics()
OPTICAL = "camera_color_optical_frame"


@pytest.fixture(scope="module")
def logged(watched, tmp_path_factory):
    """What was seen, and its log."""
    objects, _, seen = watched
    path = tmp_path_factory.mktemp("log") / "new" / "run.mcap"
    with FoxgloveStream(objects) as stream:
        stream.log_to(path)
        stream.note("camera: is there", "WARN")
        for one in seen:
            stream.live(one)
        stream.note("that was all")
    return seen, contents(path), path


def stamps(seen):
    return [Stamp.from_seconds(one.frame.timestamp) for one in seen]


def test_topics_schemas_and_stamps(logged):
    seen, found, path = logged
    assert schemas(path) == {
        TOPICS.color: "foxglove.CompressedImage",
        TOPICS.calibration: "foxglove.CameraCalibration",
        TOPICS.annotations: "foxglove.ImageAnnotations",
        TOPICS.depth: "foxglove.RawImage",
        TOPICS.cloud: "foxglove.PointCloud",
        TOPICS.transforms: "foxglove.FrameTransforms",
        TOPICS.scene: "foxglove.SceneUpdate",
        TOPICS.detections: "planegrasp.DetectionsMessage",
        TOPICS.tracks: "planegrasp.TracksMessage",
        TOPICS.library: "planegrasp.LibraryEvent",
        TOPICS.events: "foxglove.Log",
    }
    times = [stamp.total_nanoseconds for stamp in stamps(seen)]
    for topic, messages in found.items():
        if topic not in (TOPICS.library, TOPICS.events):
            assert [time for time, _ in messages] == times, topic
    for topic in (TOPICS.color, TOPICS.calibration, TOPICS.depth, TOPICS.cloud):
        assert [stamp_of(message) for _, message in found[topic]] == stamps(seen)
        assert {message.frame_id for _, message in found[topic]} == {OPTICAL}
    assert [stamp_of(message) for _, message in found[TOPICS.annotations]] == stamps(seen)


def test_images_depth_and_calibration(logged):
    seen, found, _ = logged
    for one, (_, color), (_, depth), (_, info) in zip(
        seen, *(found[t] for t in (TOPICS.color, TOPICS.depth, TOPICS.calibration)), strict=True
    ):
        assert color.format == "png"
        bgr = cv2.imdecode(np.frombuffer(color.data, np.uint8), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(bgr[:, :, ::-1], one.frame.color)
        assert (depth.width, depth.height) == (640, 480)
        assert (depth.encoding, depth.step) == ("32FC1", 2560)
        metres = np.frombuffer(depth.data, "<f4").reshape(480, 640)
        np.testing.assert_array_equal(metres, one.frame.depth)
        camera = one.frame.camera
        assert (info.width, info.height) == (camera.width, camera.height)
        assert info.distortion_model == "plumb_bob"
        np.testing.assert_array_equal(np.reshape(info.K, (3, 3)), camera.matrix)
        np.testing.assert_array_equal(np.reshape(info.P, (3, 4))[:, :3], camera.matrix)
        np.testing.assert_array_equal(np.reshape(info.R, (3, 3)), np.eye(3))
        np.testing.assert_array_equal(info.D, camera.coefficients)


def test_the_cloud_is_the_depth_image(logged):
    seen, found, _ = logged
    (_, cloud), frame_ = found[TOPICS.cloud][2], seen[2].frame
    names = [(field.name, field.offset, field.type) for field in cloud.fields]
    assert names == [
        *(("x", 0, 7), ("y", 4, 7), ("z", 8, 7)),
        *(("red", 12, 1), ("green", 13, 1), ("blue", 14, 1), ("alpha", 15, 1)),
    ]
    assert cloud.point_stride == 16
    kind = np.dtype([("p", "<f4", 3), ("c", "u1", 4)])
    points = np.frombuffer(cloud.data, kind)
    assert 2500 < len(points) <= 5000
    np.testing.assert_allclose(matrix(cloud.pose), np.eye(4))
    pixels = frame_.camera.project(points["p"].astype(np.float64))
    u, v = np.rint(Undistorted(frame_.camera).camera.undistort(pixels)).astype(int).T
    np.testing.assert_allclose(frame_.depth[v, u], points["p"][:, 2])
    np.testing.assert_array_equal(frame_.color[v, u], points["c"][:, :3])
    assert set(points["c"][:, 3].tolist()) == {255}


def test_annotations_are_the_outlines_axes_and_labels(logged):
    seen, found, _ = logged
    for one, (_, drawn) in zip(seen, found[TOPICS.annotations], strict=True):
        (detection,) = one.detections
        outline, axes = drawn.points
        corners = [(point.x, point.y) for point in outline.points]
        np.testing.assert_array_equal(corners, detection.corners)
        assert (outline.type, axes.type) == (2, 4), "a loop, and a list of lines"
        ends = np.array([(point.x, point.y) for point in axes.points])
        length = 0.5 * min(detection.model.faces[0].width, detection.model.faces[0].height)
        expected = axis_ends(detection, one.frame.camera, length)
        np.testing.assert_allclose(ends[::2], expected[[0, 0, 0]], atol=1e-9)
        np.testing.assert_allclose(ends[1::2], expected[1:], atol=0.5)
        assert [color.r > 0.9 for color in axes.outline_colors] == [True, False, False]
        about = {pair.key: pair.value for pair in outline.metadata}
        assert about == {"name": detection.name, "instance": "0", "face": "front"}
        (label,) = drawn.texts
        assert label.text.startswith(f"{detection.name} · 0.8")
        assert label.position.y == detection.corners[:, 1].min()


def test_transforms_and_boxes_are_those_of_the_tracks(logged):
    seen, found, _ = logged
    for one, (_, transforms), (_, scene) in zip(
        seen, found[TOPICS.transforms], found[TOPICS.scene], strict=True
    ):
        (track,) = live_messages(one)[1].objects
        body, placed = transforms.transforms
        assert (body.parent_frame_id, body.child_frame_id) == ("camera_link", OPTICAL)
        turn = rotation(body.rotation).as_matrix()
        np.testing.assert_allclose(turn, OPTICAL_IN_BODY.rotation.as_matrix(), atol=1e-15)
        assert (placed.parent_frame_id, placed.child_frame_id) == (OPTICAL, f"objects/{track.name}")
        assert stamp_of(placed) == Stamp.from_seconds(one.frame.timestamp)
        position, turn = placed.translation, placed.rotation
        assert (position.x, position.y, position.z) == track.pose.pose.position
        assert (turn.x, turn.y, turn.z, turn.w) == track.pose.pose.orientation
        (entity,) = scene.entities
        assert (entity.id, entity.frame_id) == (f"objects/{track.name}", OPTICAL)
        (cube,) = entity.cubes
        assert (cube.size.x, cube.size.y, cube.size.z) == track.box.size
        T = track.pose.pose.T * RigidTransform.from_translation(track.box.centre)
        np.testing.assert_allclose(matrix(cube.pose), T.as_matrix(), atol=1e-12)
        (text,) = entity.texts
        assert text.text == track.name
        (axes,) = entity.lines
        ends = np.array([(p.x, p.y, p.z) for p in axes.points])
        np.testing.assert_allclose(ends[::2], [track.pose.pose.position] * 3)
        along = (ends[1::2] - ends[::2]) / np.linalg.norm(ends[1] - ends[0])
        np.testing.assert_allclose(along.T, track.pose.pose.T.rotation.as_matrix(), atol=1e-9)


def test_all_messages_of_the_model_field_by_field(logged, watched):
    seen, found, _ = logged
    for one, (_, detections), (_, tracks) in zip(
        seen, found[TOPICS.detections], found[TOPICS.tracks], strict=True
    ):
        expected = live_messages(one)
        assert_equal(detections, expected[0])
        assert_equal(tracks, expected[1])
    first = stamps(seen)[0].total_nanoseconds
    ((time, added),) = found[TOPICS.library]
    assert time == first, "what comes before the first frame has its time"
    (event,) = library_events((), watched[0], Stamp())
    assert_equal(added, event)
    assert [(t, m.message, m.level) for t, m in found[TOPICS.events]] == [
        (first, f"object added: {watched[0][0].name}", 2),
        (first, "camera: is there", 3),
        (stamps(seen)[-1].total_nanoseconds, "that was all", 2),
    ]


def test_schemas_are_of_the_kind_that_foxglove_reads(logged):
    """Its reader knows objects, lists of objects and of plain values, and plain values."""
    plain = {"number", "integer", "string", "boolean"}

    def check(schema, value, where):
        assert schema["type"] == "object", where
        assert set(schema["properties"]) == set(value), where
        for name, member in schema["properties"].items():
            item = value[name]
            if member["type"] == "array":
                if member["items"]["type"] == "object":
                    for one in item or ():
                        check(member["items"], one, f"{where}.{name}")
                else:
                    assert member["items"]["type"] in plain
                    assert all(isinstance(one, (int, float, str)) for one in item or ())
            elif member["type"] == "object":
                if item is not None:
                    check(member, item, f"{where}.{name}")
            else:
                assert member["type"] in plain, where

    _, found, _ = logged
    check(schema_of(DetectionsMessage), found[TOPICS.detections][0][1], "detections")
    check(schema_of(TracksMessage), found[TOPICS.tracks][0][1], "tracks")
    check(schema_of(LibraryEvent), found[TOPICS.library][0][1], "library")
    check(schema_of(GraspPlanMessage), document_of(plan()), "plan")
