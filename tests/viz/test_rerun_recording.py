"""Recordings can be read back, and say what was written."""

from __future__ import annotations

import builtins

import cv2
import numpy as np
import pytest
from rrd import rows

from planegrasp.errors import MissingExtraError
from planegrasp.objects import ObjectModel, PlanarFace
from planegrasp.rgbd import RGBDFrame
from planegrasp.viz.rerun_recording import RerunRecording, point_cloud


@pytest.fixture
def recording(tmp_path, frame, detection):
    """Found in frame 0 and 1, not in 2; frame 3 has no depth and another timestamp."""
    pytest.importorskip("rerun.chunk", reason="needs rerun-sdk with its reader")
    image = np.zeros((280, 400, 3), np.uint8)
    book = ObjectModel("book", (PlanarFace("front", image, 0.20, 0.14),))
    later = RGBDFrame(frame.color, None, frame.camera, "d", 2.5)
    with RerunRecording(tmp_path / "out" / "a.rrd", [book]) as writer:
        writer.write(frame, [detection(), detection("stranger", (0.1, 0, 0.9))])
        writer.write(frame, [detection(translation=(0.0, 0.0, 0.5))])
        writer.write(frame, [])
        writer.write(later, [detection(with_pose=False)])
    return tmp_path / "out" / "a.rrd"


def test_poses_by_frame_and_cleared_when_gone(recording, detection):
    poses = rows(recording, "/world/objects/book/0", "Transform3D:translation")
    assert [number for number, _ in poses] == [0, 1]
    np.testing.assert_allclose(poses[0][1], [[0.03, -0.02, 0.7]], atol=1e-6)
    np.testing.assert_allclose(poses[1][1], [[0.0, 0.0, 0.5]], atol=1e-6)
    ((_, quaternion), _) = rows(recording, "/world/objects/book/0", "Transform3D:quaternion")
    expected = detection().T_camera_object.rotation.as_quat()
    np.testing.assert_allclose(quaternion[0], expected, atol=1e-6)
    cleared = rows(recording, "/world/objects/book/0", "Clear:is_recursive")
    assert cleared == [(2, [True])]
    assert rows(recording, "/world/objects/stranger/0", "Clear:is_recursive") == [(1, [True])]


def test_camera_once_and_images_in_every_frame(recording, camera):
    ((number, K),) = rows(recording, "/world/camera", "Pinhole:image_from_camera")
    assert number == 0
    np.testing.assert_allclose(np.reshape(K, (3, 3)).T, camera.matrix, rtol=1e-6)
    images = rows(recording, "/world/camera/color", "EncodedImage:blob")
    assert [number for number, _ in images] == [0, 1, 2, 3]
    picture = cv2.imdecode(np.array(images[0][1][0], np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (camera.height, camera.width, 3)
    np.testing.assert_allclose(picture[120, 160], 90, atol=4)


def test_depth_is_stored_in_metres_and_cleared_without(recording, camera):
    depths = rows(recording, "/world/camera/depth", "EncodedDepthImage:blob")
    assert [number for number, _ in depths] == [0, 1, 2]
    ((_, meter), *_) = rows(recording, "/world/camera/depth", "EncodedDepthImage:meter")
    units = cv2.imdecode(np.array(depths[0][1][0], np.uint8), cv2.IMREAD_UNCHANGED)
    assert units[120, 160] / meter[0] == pytest.approx(0.8)
    assert units[5, 160] == 0
    assert rows(recording, "/world/camera/depth", "Clear:is_recursive") == [(3, [True])]
    clouds = rows(recording, "/world/cloud", "Points3D:positions")
    assert len(clouds) == 3
    points = np.array(clouds[0][1])
    np.testing.assert_allclose(points[:, 2], 0.8, rtol=1e-6)


def test_faces_carry_their_picture_once(recording):
    face = "/world/objects/book/0/faces/front"
    corners = rows(recording, face, "Mesh3D:vertex_positions")
    assert [number for number, _ in corners] == [0, 1]
    np.testing.assert_allclose(corners[0][1][0], [-0.1, 0.07, 0], atol=1e-7)
    assert [n for n, _ in rows(recording, face, "Mesh3D:albedo_texture_buffer")] == [None]
    assert len(rows(recording, "/world/objects/stranger/0/axes", "Arrows3D:vectors")) == 1
    assert not rows(recording, "/world/objects/stranger/0/faces/front", "Mesh3D:vertex_positions")


def test_outlines_are_those_of_a_camera_without_a_lens(recording, detection, camera):
    outlines = rows(recording, "/world/camera/outlines/book/0", "LineStrips2D:strips")
    assert [number for number, _ in outlines] == [0, 1, 3]
    found = detection(with_pose=False)
    expected = camera.undistort(np.vstack([found.corners, found.corners[:1]]))
    np.testing.assert_allclose(outlines[2][1][0], expected, atol=1e-3)


def test_blueprint_and_time(recording):
    from rerun.chunk import RrdReader

    reader = RrdReader(recording)
    assert len(reader.recordings()) == len(reader.blueprints()) == 1
    chunks = [c for c in reader.stream() if c.entity_path == "/world/camera/color"]
    stamps = [
        stamp.total_seconds()
        for c in chunks
        for stamp in c.to_record_batch().column("time").to_pylist()
    ]
    assert sorted(stamps) == [1.5, 1.5, 1.5, 2.5]


def test_point_cloud_lies_on_the_plane_that_was_seen(frame):
    points, colors, radius = point_cloud(frame.depth, frame.color, frame.camera)
    assert len(points) == len(colors)
    assert 5_000 < len(points) <= 20_000
    np.testing.assert_array_equal(colors, 90)
    u = frame.camera.fx * points[:, 0] / points[:, 2] + frame.camera.cx
    np.testing.assert_allclose(u, np.rint(u), atol=1e-3)
    assert radius == pytest.approx(0.6 * 2 * 0.8 / 300)
    empty, _, none = point_cloud(0 * frame.depth, frame.color, frame.camera)
    assert (len(empty), none) == (0, 0.0)


def test_a_recording_that_cannot_be_written(tmp_path):
    pytest.importorskip("rerun")
    with pytest.raises(OSError, match="cannot be written"):
        RerunRecording(tmp_path)


def test_without_rerun(tmp_path, monkeypatch):
    real_import = builtins.__import__

    def without_rerun(name, *args, **kwargs):
        if name.split(".")[0] == "rerun":
            raise ImportError(name)
        return real_import(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without_rerun)
    with pytest.raises(MissingExtraError, match=r"planegrasp\[rerun\]"):
        RerunRecording(tmp_path / "a.rrd")
    assert not (tmp_path / "a.rrd").exists()
