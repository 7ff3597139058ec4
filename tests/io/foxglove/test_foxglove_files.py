"""Formats, rates, chunks and settings of a log."""

from __future__ import annotations

import json

import pytest
from mcap_contents import chunks, contents, schemas
from recorded_frames import frame

from planegrasp.errors import InvalidInputError, RecordingError
from planegrasp.io.foxglove import ColorFormat, FoxgloveConfig, FoxgloveStream, FoxgloveTopics
from planegrasp.io.foxglove.documents import encoded
from planegrasp.io.messages import GraspVerdict

TOPICS = FoxgloveTopics()


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
