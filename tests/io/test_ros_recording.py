"""ROS recordings, written by rosbags, are read as the frames that went in."""

from __future__ import annotations

import shutil
import sqlite3

import cv2
import numpy as np
import pytest
from recorded_frames import CAMERA, HEIGHT, START, WIDTH, assert_same, frame

from planegrasp.errors import CameraError, SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.recording import open_recorder
from planegrasp.io.sources import RecordingTopics, open_source

pytest.importorskip("rosbags")
pytest.importorskip("mcap")

from ros_bags import COLOR, COLOR_INFO, DEPTH, DEPTH_INFO, Bag, png

KINDS = ["bag", "sqlite3", "mcap", "mcap file"]
GRAY = np.arange(WIDTH * HEIGHT, dtype=np.uint8).reshape(HEIGHT, WIDTH) * 5
UNITS = (np.arange(WIDTH * HEIGHT, dtype=np.uint16).reshape(HEIGHT, WIDTH) * 37) + 300
UNITS[0, 0] = 0


@pytest.mark.parametrize("kind", KINDS)
def test_frames_are_read(tmp_path, kind):
    frames = [frame(i) for i in range(4)]
    bag = Bag(kind)
    for one in frames:
        bag.text("/chatter", one.timestamp)
        bag.frame(one)
    path = bag.write(tmp_path)
    source = open_source(path)
    assert (source.name, source.length, source.camera, source.notes) == (path.name, 4, None, ())
    assert source.topics == RecordingTopics(COLOR, DEPTH, COLOR_INFO)
    assert_same(list(source), frames)
    assert len(list(source)) == 4, "iterating again starts again"


@pytest.mark.parametrize("kind", ["bag", "mcap"])
def test_depth_is_matched_within_half_a_frame(tmp_path, kind):
    gaps = [0.01, -0.016, 0.02, 0.0]  # s; half a frame is 0.0167 s
    bag = Bag(kind)
    for i, gap in enumerate(gaps):
        bag.frame(frame(i), depth_stamp=frame(i).timestamp + gap)
    # Depth is recorded after three colour images: it has to be computed first.
    bag.messages.sort(key=lambda entry: entry[2] + 0.1 * (entry[0] == DEPTH))
    bag.messages = [(t, m, START + i / 100) for i, (t, m, _) in enumerate(bag.messages)]
    read = list(open_source(bag.write(tmp_path)))
    assert [one.depth is not None for one in read] == [True, True, False, True]
    assert_same([read[i] for i in (0, 1, 3)], [frame(i) for i in (0, 1, 3)])


def test_depth_that_is_missing_for_frames(tmp_path):
    frames = [frame(i, depth=i not in (0, 2)) for i in range(5)]
    bag = Bag("mcap")
    for one in frames:
        bag.frame(one)
    assert_same(list(open_source(bag.write(tmp_path))), frames)


def single(bag, tmp_path, **options):
    (read,) = open_source(bag.write(tmp_path), **options)
    return read


RGB = frame(0).color
ALPHA = np.full((HEIGHT, WIDTH, 1), 9, np.uint8)


@pytest.mark.parametrize("kind", ["bag", "mcap"])
@pytest.mark.parametrize(
    ("encoding", "pixels", "expected"),
    [
        ("rgb8", RGB, RGB),
        ("bgr8", RGB[:, :, ::-1], RGB),
        ("rgba8", np.concatenate([RGB, ALPHA], axis=2), RGB),
        ("bgra8", np.concatenate([RGB[:, :, ::-1], ALPHA], axis=2), RGB),
        ("mono8", GRAY, np.repeat(GRAY[:, :, None], 3, axis=2)),
    ],
)
def test_colour_encodings(tmp_path, kind, encoding, pixels, expected):
    bag = Bag(kind)
    bag.info(COLOR_INFO, CAMERA, START)
    bag.image(COLOR, pixels, encoding, START, padding=5)
    np.testing.assert_array_equal(single(bag, tmp_path).color, expected)


@pytest.mark.parametrize("bigendian", [False, True])
@pytest.mark.parametrize(
    ("encoding", "pixels"),
    [
        ("16UC1", UNITS),
        ("mono16", UNITS),
        ("32FC1", np.where(UNITS > 0, UNITS / 1000, np.nan).astype(np.float32)),
    ],
)
def test_depth_encodings(tmp_path, encoding, pixels, bigendian):
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START)
    bag.image(COLOR, RGB, "rgb8", START)
    bag.image(DEPTH, pixels, encoding, START, padding=2, bigendian=bigendian)
    np.testing.assert_allclose(single(bag, tmp_path).depth, UNITS / 1000, atol=1e-6)


def test_given_depth_scale(tmp_path):
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START)
    bag.image(COLOR, RGB, "rgb8", START)
    bag.image(DEPTH, UNITS, "16UC1", START)
    read = single(bag, tmp_path, depth_scale=0.0001)
    np.testing.assert_allclose(read.depth, UNITS / 10000, atol=1e-7)


def test_compressed_images(tmp_path):
    bag = Bag("bag")
    bag.info(COLOR_INFO, CAMERA, START)
    bag.compressed(COLOR + "/compressed", png(RGB[:, :, ::-1]), "rgb8; png compressed bgr8", START)
    header = np.array([0, 0, 0], "<f4").tobytes()
    described = "16UC1; compressedDepth png"
    bag.compressed(DEPTH + "/compressedDepth", header + png(UNITS), described, START)
    read = single(bag, tmp_path)
    np.testing.assert_array_equal(read.color, RGB)
    np.testing.assert_allclose(read.depth, UNITS / 1000, atol=1e-6)


def test_jpeg_images(tmp_path):
    smooth = cv2.resize(np.array([[[200, 30, 60], [20, 90, 220]]], np.uint8), (WIDTH, HEIGHT))
    data = cv2.imencode(".jpg", smooth[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 100])[1]
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START)
    bag.compressed(COLOR + "/compressed", data, "jpeg", START)
    read = single(bag, tmp_path)
    assert np.abs(read.color.astype(int) - smooth).mean() < 8, "red and blue are not swapped"


def test_compressed_float_depth(tmp_path):
    """Inverse depth in 16 bits, by the formula of image_transport's plugin."""
    z0, farthest = 100.0, 10.0
    a = z0 * (z0 + 1)
    b = 1 - a / farthest
    metres = np.linspace(0.5, 5, WIDTH * HEIGHT).reshape(HEIGHT, WIDTH)
    stored = np.rint(a / metres + b).astype(np.uint16)
    stored[0, 0] = 0
    header = np.array([1], "<i4").tobytes() + np.array([a, b], "<f4").tobytes()
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START)
    bag.image(COLOR, RGB, "rgb8", START)
    described = "32FC1; compressedDepth png"
    bag.compressed(DEPTH + "/compressedDepth", header + png(stored), described, START)
    depth = single(bag, tmp_path).depth
    assert depth[0, 0] == 0
    np.testing.assert_allclose(depth.ravel()[1:], metres.ravel()[1:], rtol=5e-4)


@pytest.mark.parametrize(
    ("color", "depth", "message"),
    [
        ("yuv422", "16UC1", r"frame 0, .*image_raw: its encoding 'yuv422' is none of a colour"),
        ("rgb8", "8UC1", r"aligned_depth.*: its encoding '8UC1' is none of a depth image"),
    ],
)
def test_unknown_encodings(tmp_path, color, depth, message):
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START)
    bag.image(COLOR, RGB, color, START)
    bag.image(DEPTH, UNITS, depth, START)
    with pytest.raises(SourceError, match=message):
        single(bag, tmp_path)


def test_an_image_with_too_little_data(tmp_path):
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START)
    bag.image(COLOR, RGB, "rgb8", START)
    bag.messages[-1][1].data = bag.messages[-1][1].data[:-1]
    with pytest.raises(SourceError, match="8×6 rgb8 with rows of 24 bytes has 143 bytes of data"):
        single(bag, tmp_path)


def test_an_image_that_cannot_be_decoded(tmp_path):
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START)
    bag.compressed(COLOR + "/compressed", b"no image", "jpeg", START)
    with pytest.raises(SourceError, match="an image of format 'jpeg' cannot be decoded"):
        single(bag, tmp_path)


def test_depth_that_is_not_aligned(tmp_path):
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START)
    bag.image(COLOR, RGB, "rgb8", START)
    bag.image("/camera/depth/image_raw", UNITS[:, :-1], "16UC1", START)
    path = bag.write(tmp_path)
    source = open_source(path)
    assert source.notes == (f"taking depth of /camera/depth/image_raw as aligned to {COLOR}",)
    with pytest.raises(SourceError, match="depth is 7×6 and colour 8×6: name a topic of depth"):
        list(source)
    source = open_source(path, topics=RecordingTopics(depth=""))
    assert source.notes == ()
    assert [one.depth for one in source] == [None]


def test_aligned_depth_goes_before_other_depth(tmp_path):
    bag = Bag("mcap")
    bag.frame(frame(0))
    bag.image("/camera/depth/image_rect_raw", UNITS, "16UC1", START)
    bag.image("/camera/infra1/image_rect_raw", GRAY, "mono8", START)
    bag.compressed(COLOR + "/compressed", b"", "jpeg", START)
    bag.info(DEPTH_INFO, CAMERA, START)
    source = open_source(bag.write(tmp_path))
    assert source.topics == RecordingTopics(COLOR, DEPTH, COLOR_INFO)
    assert_same(list(source), [frame(0)])


def test_which_of_several_has_to_be_named(tmp_path):
    left, right = frame(0), frame(1, depth=False, stamp=START)
    bag = Bag("mcap")
    for side, one in (("left", left), ("right", right)):
        bag.info(f"/{side}/camera_info", one.camera, START)
        bag.image(f"/{side}/image", one.color, "rgb8", START)
    path = bag.write(tmp_path)
    message = r"colour may be any of /left/image, /right/image: name one; the recording has .*Info"
    with pytest.raises(SourceError, match=message):
        open_source(path)
    source = open_source(path, topics=RecordingTopics(color="/right/image"))
    assert source.topics.info == "/right/camera_info"
    np.testing.assert_array_equal(next(iter(source)).color, right.color)
    with pytest.raises(SourceError, match=r"no topic '/middle' for color; the recording has /left"):
        open_source(path, topics=RecordingTopics(color="/middle"))
    with pytest.raises(SourceError, match="no topic '/left/image' for info"):
        open_source(path, topics=RecordingTopics("/left/image", info="/left/image"))


def test_no_colour_at_all(tmp_path):
    bag = Bag("bag")
    bag.text("/chatter", START)
    message = r"run\.bag: there is no colour image .*; the recording has /chatter \(std_msgs"
    with pytest.raises(SourceError, match=message):
        open_source(bag.write(tmp_path))


def test_no_camera_info(tmp_path):
    bag = Bag("sqlite3")
    bag.image(COLOR, RGB, "rgb8", START)
    path = bag.write(tmp_path)
    with pytest.raises(SourceError, match=rf"run: there is no camera_info for {COLOR}"):
        open_source(path)
    source = open_source(path, camera=CAMERA)
    assert next(iter(source)).camera == source.camera == CAMERA


def test_a_camera_that_was_not_calibrated(tmp_path):
    bag = Bag("mcap")
    bag.image(COLOR, RGB, "rgb8", START)
    bag.info(COLOR_INFO, CAMERA, START)
    bag.messages[-1][1].k[:] = 0
    with pytest.raises(CameraError, match=r"camera_info: its camera_info is not calibrated"):
        open_source(bag.write(tmp_path))


def test_rectified_images_have_the_projections_camera(tmp_path):
    bag = Bag("bag")
    p = [9.0, 0, 3.0, 0, 0, 9.5, 2.0, 0, 0, 0, 1, 0]
    bag.info("/camera/rgb/camera_info", CAMERA, START, p=p)
    bag.image("/camera/rgb/image_rect_color", RGB, "rgb8", START)
    assert single(bag, tmp_path).camera == PinholeCamera(WIDTH, HEIGHT, 9.0, 9.5, 3.0, 2.0)


def test_rational_lens_model(tmp_path):
    big = PinholeCamera(640, 480, 500.0, 500.0, 319.5, 239.5)
    d = [0.3, 0.1, 0.001, -0.001, 0.02, 0.25, 0.05, 0.01]
    bag = Bag("mcap")
    bag.info(COLOR_INFO, big, START, model="rational_polynomial", d=d)
    bag.image(COLOR, np.zeros((480, 640, 3), np.uint8), "rgb8", START)
    camera = single(bag, tmp_path).camera
    points = np.array([[-0.5, -0.4, 1.0], [0.6, 0.45, 1.0], [0.1, -0.2, 1.0]])
    expected = cv2.projectPoints(points, np.zeros(3), np.zeros(3), big.matrix, np.array(d))[0]
    np.testing.assert_allclose(camera.project(points), expected[:, 0], atol=0.1)


def test_unknown_lens_model(tmp_path):
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START, model="mirror")
    bag.image(COLOR, RGB, "rgb8", START)
    with pytest.raises(CameraError, match="its lens model 'mirror' is not known"):
        open_source(bag.write(tmp_path))


def test_headers_without_a_time(tmp_path):
    bag = Bag("mcap")
    bag.info(COLOR_INFO, CAMERA, START)
    for i in range(3):
        bag.image(COLOR, RGB, "rgb8", 0.0, recorded=START + i)
        bag.image(DEPTH, UNITS, "16UC1", 0.0, recorded=START + i + 0.01)
    read = list(open_source(bag.write(tmp_path)))
    assert [one.timestamp for one in read] == pytest.approx([START, START + 1, START + 2])
    assert all(one.depth is not None for one in read)


def test_a_recording_that_has_no_metadata_yet(tmp_path):
    bag = Bag("mcap")
    bag.frame(frame(0))
    path = bag.write(tmp_path)
    (path / "metadata.yaml").unlink()
    assert_same(list(open_source(path)), [frame(0)])


def test_a_recording_is_known_by_what_it_holds(tmp_path):
    for kind in ("bag", "mcap file"):
        bag = Bag(kind)
        bag.frame(frame(0))
        path = shutil.copy(bag.write(tmp_path), tmp_path / "recording")
        assert_same(list(open_source(path)), [frame(0)])


@pytest.mark.parametrize("kind", ["bag", "sqlite3"])
def test_damaged_recordings(tmp_path, kind):
    bag = Bag(kind)
    for i in range(3):
        bag.frame(frame(i))
    path = bag.write(tmp_path)
    file = path if kind == "bag" else next(path.glob("*.db3"))
    data = file.read_bytes()
    for size in (0, 5, 20, len(data) // 2, len(data) - 10):
        file.write_bytes(data[:size])
        with pytest.raises(SourceError, match="run"):
            list(open_source(path))


def test_wrong_metadata(tmp_path):
    bag = Bag("sqlite3")
    bag.frame(frame(0))
    path = bag.write(tmp_path)
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: 9}\n")
    with pytest.raises(SourceError, match="run is a damaged recording: A metadata key is missing"):
        open_source(path)
    (path / "metadata.yaml").write_text("[")
    with pytest.raises(SourceError, match="run is a damaged recording: Could not load YAML"):
        open_source(path)


def test_a_damaged_message(tmp_path):
    bag = Bag("sqlite3")
    bag.frame(frame(0))
    path = bag.write(tmp_path)
    with sqlite3.connect(next(path.glob("*.db3"))) as database:
        database.execute("UPDATE messages SET data = x'00010000ffffffff'")
    with pytest.raises(SourceError, match=r"a message of .* is damaged"):
        open_source(path)


@pytest.mark.parametrize("option", [{"depth": "x"}, {"field_of_view": 1.0}])
def test_options_that_are_not_for_recordings(tmp_path, option):
    bag = Bag("mcap")
    bag.frame(frame(0))
    with pytest.raises(SourceError, match="a ROS recording"):
        open_source(bag.write(tmp_path), **option)


def test_topics_are_for_recordings(tmp_path):
    with open_recorder(tmp_path / "run") as recorder:
        recorder.write(frame(0))
    with pytest.raises(SourceError, match="topics are for ROS recordings"):
        open_source(tmp_path / "run", topics=RecordingTopics(depth=""))


def test_what_we_record_is_read_by_rosbags(tmp_path):
    from rosbags.highlevel import AnyReader

    with open_recorder(tmp_path / "run.mcap") as recorder:
        recorder.write(frame(0))
    with AnyReader([tmp_path / "run.mcap"]) as reader:
        read = {
            connection.topic: reader.deserialize(data, connection.msgtype)
            for connection, _, data in reader.messages()
        }
    assert sorted(read) == [DEPTH, COLOR_INFO, COLOR]
    np.testing.assert_array_equal(read[COLOR].data.reshape(HEIGHT, WIDTH, 3), frame(0).color)
    assert read[COLOR].header.stamp.sec == int(START)
    assert read[COLOR_INFO].k[4] == CAMERA.fy
