"""A log is a source of frames: what is detected in it is what was detected before."""

from __future__ import annotations

import foxglove
import numpy as np
import pytest
from foxglove.channels import CameraCalibrationChannel, RawImageChannel
from foxglove.messages import CameraCalibration, RawImage
from mcap_contents import contents
from recorded_frames import CAMERA, assert_same, frame

from planegrasp.errors import CameraError, SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.foxglove import ColorFormat, FoxgloveConfig, FoxgloveStream, FoxgloveTopics
from planegrasp.io.messages import live_messages
from planegrasp.io.sinks.as_dict import frame_to_dict
from planegrasp.io.sources import RecordingTopics, open_source
from planegrasp.live import Live, LiveConfig

SMALL = PinholeCamera(2, 2, 1.0, 1.0, 0.5, 0.5)
EXACT = [ColorFormat.PNG, ColorFormat.RAW]


def log(path, frames, color=ColorFormat.PNG):
    with FoxgloveStream(config=FoxgloveConfig(color=color)) as stream:
        stream.log_to(path)
        for one in frames:
            stream.detections(one, [])


def assert_exactly(read, written):
    assert len(read) == len(written)
    for a, b in zip(read, written, strict=True):
        np.testing.assert_array_equal(a.color, b.color)
        np.testing.assert_array_equal(a.depth, b.depth)
        assert (a.camera, a.timestamp) == (b.camera, b.timestamp)


@pytest.mark.parametrize("color", EXACT)
def test_detections_are_the_same(watched, tmp_path, color):
    """All that is detected, to the last bit: frames, poses, covariances, homographies."""
    objects, detector, seen = watched
    with FoxgloveStream(objects, FoxgloveConfig(color=color)) as stream:
        stream.log_to(tmp_path / "run.mcap")
        for one in seen:
            stream.live(one)
    source = open_source(tmp_path / "run.mcap")
    assert (source.length, source.notes, source.name) == (len(seen), (), "run.mcap")
    read = list(source)
    assert_exactly(read, [one.frame for one in seen])
    for a, b in ((read[0], seen[0].frame), (read[4], seen[4].frame)):
        again, before = detector.detect(a), detector.detect(b)
        assert before
        assert frame_to_dict(a, again)["detections"] == frame_to_dict(b, before)["detections"], (
            "to the last bit"
        )
    with Live(detector, config=LiveConfig(background=False)) as live:
        for frame_read, one in zip(read, seen, strict=True):
            assert live_messages(live.process(frame_read)) == live_messages(one)


def test_jpeg_is_near(watched, tmp_path):
    """As docs/foxglove.md says."""
    _, detector, seen = watched
    frames = [one.frame for one in seen]
    log(tmp_path / "run.mcap", frames, ColorFormat.JPEG)
    read = list(open_source(tmp_path / "run.mcap"))
    for a, b in zip(read, frames, strict=True):
        assert not np.array_equal(a.color, b.color)
        assert np.abs(a.color.astype(int) - b.color).mean() < 4
        np.testing.assert_array_equal(a.depth, b.depth)
    (again,), (before,) = detector.detect(read[0]), detector.detect(frames[0])
    apart = before.pose.T_camera_object.inv() * again.pose.T_camera_object
    assert np.linalg.norm(apart.translation) < 0.0005
    assert np.rad2deg(apart.rotation.magnitude()) < 0.2


@pytest.mark.parametrize("unit", [0.001, 0.0001])
def test_depth_in_millimetres_and_finer(tmp_path, unit):
    """A sensor's integers times its unit, as every source of planegrasp gives it."""
    frames = [frame(i) for i in range(3)]
    rng = np.random.default_rng(0)
    for one in frames:
        one.depth[:] = rng.integers(0, 9000, one.depth.shape, np.uint16) * np.float32(unit)
    log(tmp_path / "run.mcap", frames)
    assert_exactly(list(open_source(tmp_path / "run.mcap")), frames)
    kinds = {message.encoding for _, message in depths(tmp_path / "run.mcap")}
    assert kinds == {"16UC1" if unit == 0.001 else "32FC1"}


def depths(path):
    return contents(path)[FoxgloveTopics().depth]


def test_depth_beyond_16_bits(tmp_path):
    one = frame(0)
    one.depth[2, 3] = np.float32(70.0)
    log(tmp_path / "run.mcap", [one])
    assert_exactly(list(open_source(tmp_path / "run.mcap")), [one])


def test_frames_without_depth_and_other_cameras(tmp_path):
    other = PinholeCamera(8, 6, 12.0, 12.0, 3.5, 2.5)
    frames = [frame(0), frame(1, depth=False), frame(2, size=(12, 10)), frame(3, camera=other)]
    log(tmp_path / "run.mcap", frames)
    assert_same(list(open_source(tmp_path / "run.mcap")), frames)
    log(tmp_path / "flat.mcap", [frame(0, depth=False)])
    source = open_source(tmp_path / "flat.mcap")
    assert source.notes == ("flat.mcap has no depth images",)
    assert next(iter(source)).camera == CAMERA


def test_frames_without_timestamps_follow_each_other(tmp_path):
    log(tmp_path / "run.mcap", [frame(i, stamp=float("nan")) for i in range(3)])
    stamps = [one.timestamp for one in open_source(tmp_path / "run.mcap")]
    np.testing.assert_allclose(np.diff(stamps), 1 / 30, atol=1e-6)


def test_topics_that_are_named(tmp_path):
    topics = FoxgloveTopics(color="/left", calibration="/left/info", depth="/z")
    with FoxgloveStream(topics=topics) as stream:
        stream.log_to(tmp_path / "run.mcap")
        stream.detections(frame(0), [])
    path = tmp_path / "run.mcap"
    source = open_source(path, topics=RecordingTopics("/left", "/z", "/left/info"))
    assert_same(list(source), [frame(0)])
    assert source.notes == ("taking depth of /z as aligned to /left",)


def test_a_camera_that_is_not_calibrated(tmp_path):
    context = foxglove.Context()
    with foxglove.open_mcap(tmp_path / "run.mcap", context=context):
        RawImageChannel("/image", context=context).log(
            RawImage(width=2, height=2, encoding="mono8", step=2, data=bytes(4)), log_time=5
        )
        CameraCalibrationChannel("/calibration", context=context).log(
            CameraCalibration(width=2, height=2), log_time=5
        )
    with pytest.raises(CameraError, match=r"/calibration: its camera_info is not calibrated"):
        open_source(tmp_path / "run.mcap")
    source = open_source(tmp_path / "run.mcap", camera=SMALL)
    (one,) = source
    assert (one.timestamp, one.color.tolist()) == (5e-9, np.zeros((2, 2, 3)).tolist())


def test_an_unknown_encoding(tmp_path):
    context = foxglove.Context()
    with foxglove.open_mcap(tmp_path / "run.mcap", context=context):
        RawImageChannel("/image", context=context).log(
            RawImage(width=2, height=2, encoding="yuv422", step=4, data=bytes(8)), log_time=5
        )
    source = open_source(tmp_path / "run.mcap", camera=SMALL)
    with pytest.raises(SourceError, match=r"frame 0, /image: its encoding 'yuv422' is none of"):
        list(source)


def write_json_images(path, *, beside=()):
    """Foxglove's images in JSON, as its schemas allow; frames in protobuf beside them."""
    context = foxglove.Context()
    with foxglove.open_mcap(path, context=context):
        schema = foxglove.Schema(
            name="foxglove.RawImage", encoding="jsonschema", data=b'{"type": "object"}'
        )
        foxglove.Channel(
            "/json/color", schema=schema, message_encoding="json", context=context
        ).log({"width": 2}, log_time=5)
        for topic in beside:
            RawImageChannel(topic, context=context).log(
                RawImage(width=2, height=2, encoding="mono8", step=2, data=bytes(4)), log_time=5
            )


def test_images_in_json_are_refused_by_name(tmp_path):
    path = tmp_path / "run.mcap"
    write_json_images(path)
    listed = r"/json/color \(foxglove.RawImage as json\)"
    with pytest.raises(SourceError, match=f"there is no colour image .*{listed}"):
        open_source(path, camera=SMALL)
    with pytest.raises(SourceError, match=f"no topic '/json/color' for color.*{listed}"):
        open_source(path, camera=SMALL, topics=RecordingTopics("/json/color"))


def test_images_in_json_beside_others(tmp_path):
    write_json_images(tmp_path / "run.mcap", beside=["/image"])
    source = open_source(tmp_path / "run.mcap", camera=SMALL)
    assert (source.length, len(list(source))) == (1, 1)


def test_one_topic_in_two_encodings(tmp_path):
    write_json_images(tmp_path / "run.mcap", beside=["/json/color"])
    with pytest.raises(SourceError, match=r"/json/color has messages of foxglove.RawImage as json"):
        list(open_source(tmp_path / "run.mcap", camera=SMALL))


def test_a_log_without_images(tmp_path):
    with FoxgloveStream(config=FoxgloveConfig(image_rate=0)) as stream:
        stream.log_to(tmp_path / "run.mcap")
        stream.detections(frame(0), [])
    with pytest.raises(SourceError, match=r"no colour image .*/planegrasp/scene"):
        open_source(tmp_path / "run.mcap")
