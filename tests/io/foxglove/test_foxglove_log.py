"""What is in a log, read by mcap's reader with the schemas in the file."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass, replace

import cv2
import numpy as np
import pytest
from mcap_contents import chunks, contents, schemas
from recorded_frames import frame
from ros2_examples import HEADER, pose

from planegrasp.errors import InvalidInputError, RecordingError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.io.foxglove import (
    ColorFormat,
    DetectionsLog,
    FoxgloveConfig,
    FoxgloveStream,
    FoxgloveTopics,
)
from planegrasp.io.foxglove.documents import document_of, encoded, schema_of
from planegrasp.io.messages import (
    DetectionsMessage,
    FrameIds,
    GraspPlanMessage,
    GraspRefusalMessage,
    GraspVerdict,
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


def stamp_of(message):
    return Stamp(message.timestamp.seconds, message.timestamp.nanos)


def matrix(message):
    """4×4 of a protobuf pose."""
    p, q = message.position, message.orientation
    T = RigidTransform.from_components([p.x, p.y, p.z], rotation(q))
    return T.as_matrix()


def rotation(q):
    return Rotation.from_quat([q.x, q.y, q.z, q.w])


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


def assert_equal(document, message):
    """The JSON says what the message says, member for member, nothing more."""
    if is_dataclass(message):
        assert list(document) == [one.name for one in fields(message)]
        for one in fields(message):
            assert_equal(document[one.name], getattr(message, one.name))
    elif isinstance(message, tuple):
        for item, value in zip(document, message, strict=True):
            if not isinstance(value, tuple):
                assert_equal(item, value)
            elif isinstance(value[0], str):
                assert (item["name"], item["value"]) == value
            else:
                assert tuple(item["values"]) == value
    else:
        assert document == message


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


@pytest.mark.parametrize(("kind", "schema"), [("raw", "RawImage"), ("jpeg", "CompressedImage")])
def test_formats_of_colour(tmp_path, kind, schema):
    config = FoxgloveConfig(color=ColorFormat.named(kind), cloud_points=0)
    with FoxgloveStream(config=config) as stream:
        stream.log_to(tmp_path / "run.mcap")
        stream.detections(frame(0), [])
    assert schemas(tmp_path / "run.mcap")[TOPICS.color] == f"foxglove.{schema}"
    found = contents(tmp_path / "run.mcap")
    assert TOPICS.cloud not in found
    ((_, image),) = found[TOPICS.color]
    if kind == "raw":
        assert (image.encoding, image.step, image.width, image.height) == ("rgb8", 24, 8, 6)
        assert image.data == frame(0).color.tobytes()
    else:
        assert image.format == "jpeg"
        assert image.data.startswith(b"\xff\xd8")


def test_images_at_a_lower_rate(tmp_path):
    with FoxgloveStream(config=FoxgloveConfig(image_rate=10)) as stream:
        stream.log_to(tmp_path / "run.mcap")
        for i in range(7):
            stream.detections(frame(i), [])
    found = contents(tmp_path / "run.mcap")
    for topic in (TOPICS.color, TOPICS.depth, TOPICS.cloud):
        assert len(found[topic]) == 3, "at 0, 1/10 and 2/10 s"
    assert len(found[TOPICS.detections]) == 7
    with FoxgloveStream(config=FoxgloveConfig(image_rate=0)) as stream:
        stream.log_to(tmp_path / "none.mcap")
        stream.detections(frame(0), [])
    assert TOPICS.color not in contents(tmp_path / "none.mcap")


def test_a_frame_is_a_chunk(tmp_path):
    with FoxgloveStream() as stream:
        log = stream.log_to(tmp_path / "run.mcap")
        for i in range(5):
            stream.detections(frame(i), [])
            size = log.path.stat().st_size
    assert log.frames == 5
    ends = [end for _, end in chunks(tmp_path / "run.mcap")]
    assert len(ends) == 5
    assert ends[-1] <= size, "the last frame was on its way to the disk before the end"


def test_values_that_are_not_finite_are_null(tmp_path):
    verdict = GraspVerdict("side", False, "", float("nan"), (("reach", float("inf")),))
    document = json.loads(encoded(verdict))
    assert document["score"] is None
    assert document["figures"] == [{"name": "reach", "value": None}]


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
    check(schema_of(GraspPlanMessage), document_of(plan(HEADER)), "plan")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("run.bag", r"run\.bag names no MCAP file: give NAME\.mcap"),
        ("there.mcap", r"there\.mcap exists already: give a new name"),
        ("file/run.mcap", "cannot be written: File exists"),
    ],
)
def test_files_that_cannot_be(tmp_path, name, message):
    (tmp_path / "there.mcap").write_text("precious")
    (tmp_path / "file").write_text("")
    with FoxgloveStream() as stream, pytest.raises(RecordingError, match=message):
        stream.log_to(tmp_path / name)
    assert (tmp_path / "there.mcap").read_text() == "precious"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"jpeg_quality": 0}, r"the quality of JPEG is 1 … 100, got 0"),
        ({"cloud_points": -1}, r"a cloud has ≥ 0 points, got -1"),
        ({"image_rate": -1.0}, r"from 0 to 1000 Hz, got -1"),
    ],
)
def test_settings_that_cannot_be(values, message):
    with pytest.raises(InvalidInputError, match=message):
        FoxgloveConfig(**values)
    with pytest.raises(InvalidInputError, match="one of png, jpeg, raw, got 'gif'"):
        ColorFormat.named("gif")
