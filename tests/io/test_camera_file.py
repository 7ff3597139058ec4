"""Camera files round-trip; what is wrong in one is named by its key."""

from __future__ import annotations

import json

import pytest

from planegrasp.errors import CameraError, SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io import read_camera, write_camera

GOOD = {"width": 640, "height": 480, "fx": 525.0, "fy": 524.5, "cx": 319.5, "cy": 239.5}


def _write(path, content):
    path.write_text(json.dumps(content))
    return path


@pytest.mark.parametrize("distortion", [(), (0.1, -0.2, 1e-3, 1 / 3, 0.05)])
def test_round_trip_is_exact(tmp_path, distortion):
    camera = PinholeCamera(641, 481, 607.178466796875, 607.1 / 3, 321.4, 241.9, distortion)
    write_camera(tmp_path / "camera.json", camera, 0.0001)
    assert read_camera(tmp_path / "camera.json") == (camera, 0.0001)


def test_scale_and_distortion_have_defaults(tmp_path):
    camera, scale = read_camera(_write(tmp_path / "c.json", GOOD))
    assert scale == 0.001
    assert camera == PinholeCamera(**GOOD)


def test_integers_are_numbers(tmp_path):
    camera, _ = read_camera(_write(tmp_path / "c.json", GOOD | {"fx": 525}))
    assert camera.fx == 525.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fx": None}, "fx: .*number, got None"),
        ({"fx": "525"}, "fx: .*number, got '525'"),
        ({"width": 640.5}, "width: .*integer, got 640.5"),
        ({"depth_scale": 0}, "depth_scale: .*greater than 0, got 0"),
        ({"distortion": 0.1}, "distortion: .*list, got 0.1"),
        ({"focal": 525.0}, r"focal is not a known key \(known: width, height, fx"),
    ],
)
def test_wrong_value(tmp_path, change, message):
    with pytest.raises(SourceError, match=message):
        read_camera(_write(tmp_path / "c.json", GOOD | change))


@pytest.mark.parametrize("key", sorted(GOOD))
def test_missing_key(tmp_path, key):
    content = {k: v for k, v in GOOD.items() if k != key}
    with pytest.raises(SourceError, match=rf"c\.json: {key} is missing"):
        read_camera(_write(tmp_path / "c.json", content))


@pytest.mark.parametrize(
    "change", [{"fx": -1.0}, {"width": 0}, {"distortion": [0.0] * 6}, {"cx": 1e6}]
)
def test_impossible_camera(tmp_path, change):
    with pytest.raises(CameraError, match=r"camera file .*c\.json: "):
        read_camera(_write(tmp_path / "c.json", GOOD | change))


def test_not_a_camera_file(tmp_path):
    with pytest.raises(SourceError, match="there is no camera file"):
        read_camera(tmp_path / "gone.json")
    with pytest.raises(SourceError, match="cannot be read"):
        read_camera(tmp_path)
    (tmp_path / "c.yaml").write_text("width: 640")
    with pytest.raises(SourceError, match="is not JSON"):
        read_camera(tmp_path / "c.yaml")
    (tmp_path / "c.bin").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SourceError, match="cannot be read"):
        read_camera(tmp_path / "c.bin")
    with pytest.raises(SourceError, match="the file: "):
        read_camera(_write(tmp_path / "list.json", [1, 2]))
