"""What is written can be read again, and says the same."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest

from planegrasp.detection import Detection, FaceDetection
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation, euler_from_rotation
from planegrasp.io import read_color
from planegrasp.io.sinks import (
    AnnotatedImageWriter,
    JsonLinesWriter,
    Summary,
    detection_to_dict,
    frame_to_dict,
)
from planegrasp.objects import ObjectModel
from planegrasp.pose.base import PoseEstimate
from planegrasp.rgbd import RGBDFrame

CAMERA = PinholeCamera(320, 240, 300.0, 300.0, 159.5, 119.5)
T = RigidTransform.from_components(
    [0.1, -0.05, 0.7], Rotation.from_euler("x", 3.0) * Rotation.from_euler("zy", [0.3, 0.2])
)
CORNERS = np.array([[100.0, 80.0], [200.0, 85.0], [195.0, 160.0], [95.0, 150.0]])
BOOK = ObjectModel.from_image("Buch", np.zeros((300, 400, 3), np.uint8), 0.2)
H = np.array([[0.25, 0.01, 100.0], [0.01, 0.25, 80.0], [1e-5, 0.0, 1.0]])


def frame(name="000007", timestamp=12.5):
    return RGBDFrame(np.full((240, 320, 3), 50, np.uint8), None, CAMERA, name, timestamp)


def detection(pose=True, **changes):
    face = FaceDetection("front", H, H, CORNERS, np.zeros((33, 2)), np.zeros((33, 2)), 0.75, 0.9)
    values = {
        "T_camera_object": T,
        "covariance": np.diag([1e-6] * 3 + [1e-5] * 3),
        "ambiguous": True,
        "alternative": T.inv(),
        "reprojection_rms": 0.4,
        "depth_pixels": 1234,
    }
    estimate = PoseEstimate(**(values | changes)) if pose else None
    return Detection(BOOK, 1, (face, face), 0.625, estimate, "" if pose else "kein Maß: ⌀")


def test_a_line_gives_back_the_pose(tmp_path):
    with JsonLinesWriter(tmp_path / "new" / "found.jsonl") as writer:
        writer.write(frame(), [detection()])
        writer.write(frame("b", None), [])
    first, second = map(json.loads, (tmp_path / "new" / "found.jsonl").read_text().splitlines())
    assert second == {"frame": "b", "timestamp": None, "detections": []}
    assert (first["frame"], first["timestamp"]) == ("000007", 12.5)
    (found,) = first["detections"]
    assert (found["name"], found["instance"], found["inliers"]) == ("Buch", 1, 66)
    assert found["score"] == 0.625
    np.testing.assert_array_equal(found["corners"], CORNERS)
    np.testing.assert_array_equal(found["homography"], H)
    np.testing.assert_array_equal(found["T_camera_object"], T.as_matrix())
    rebuilt = RigidTransform.from_components(
        found["translation"], Rotation.from_quat(found["quaternion"])
    )
    np.testing.assert_allclose(rebuilt.as_matrix(), T.as_matrix(), atol=1e-15)
    assert found["quaternion"][3] >= 0
    assert tuple(found["euler"]) == euler_from_rotation(T.rotation)
    np.testing.assert_array_equal(found["covariance"], np.diag([1e-6] * 3 + [1e-5] * 3))
    assert found["ambiguous"] is True
    np.testing.assert_array_equal(found["alternative"], T.inv().as_matrix())
    assert (found["reprojection_rms"], found["depth_pixels"]) == (0.4, 1234)
    assert found["pose_failure"] == ""
    assert [face["name"] for face in found["faces"]] == ["front", "front"]
    assert found["faces"][0]["coverage"] == 0.75
    assert found["faces"][0]["agreement"] == 0.9


def test_without_a_pose_the_same_keys_are_null():
    with_pose, without = detection_to_dict(detection()), detection_to_dict(detection(pose=False))
    assert list(with_pose) == list(without)
    assert without["pose_failure"] == "kein Maß: ⌀"
    assert without["T_camera_object"] is without["ambiguous"] is without["euler"] is None


def test_numbers_that_are_not_finite_become_null():
    covariance = np.eye(6)
    covariance[0, 0], covariance[1, 1] = np.inf, np.nan
    result = detection_to_dict(detection(covariance=covariance, reprojection_rms=float("nan")))
    text = json.dumps(result, allow_nan=False)
    assert json.loads(text)["covariance"][0][0] is None
    assert json.loads(text)["covariance"][2][2] == 1.0
    assert json.loads(text)["reprojection_rms"] is None
    assert detection_to_dict(detection(covariance=None))["covariance"] is None


def test_each_line_is_complete_before_the_next_frame(tmp_path):
    path = tmp_path / "a.jsonl"
    with JsonLinesWriter(path) as writer:
        writer.write(frame(), [detection(pose=False)])
        assert path.read_text(encoding="utf-8").endswith("}\n")
        assert "kein Maß: ⌀" in path.read_text(encoding="utf-8")
        writer.write(frame(), [])
        assert len(path.read_text(encoding="utf-8").splitlines()) == 2


def test_a_stream_stays_open():
    stream = io.StringIO()
    with JsonLinesWriter(stream) as writer:
        writer.write(frame(), [detection()])
    assert json.loads(stream.getvalue()) == frame_to_dict(frame(), [detection()])


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(IsADirectoryError):
        JsonLinesWriter(tmp_path)


def test_annotated_images(tmp_path):
    with AnnotatedImageWriter(tmp_path / "out", {"Buch": (0, 255, 0)}) as writer:
        writer.write(frame(), [detection()])
        writer.write(frame("../a b"), [])
        writer.write(frame(""), [])
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["000002.png", "000007.png", "_a_b.png"]
    drawn = read_color(tmp_path / "out" / "000007.png")
    assert drawn.shape == (240, 320, 3)
    x, y = (0.9 * CORNERS[0] + 0.1 * CORNERS[1]).round().astype(int)
    assert drawn[y, x, 1] > 200
    np.testing.assert_array_equal(read_color(tmp_path / "out" / "_a_b.png"), 50)


def test_summary_counts_by_object_and_instance():
    with Summary(["Buch", "Dose"]) as summary:
        summary.write(frame(), [detection()])
        summary.write(frame(), [detection(pose=False)])
        summary.write(frame(), [])
    rows = {(row.name, row.instance): row.to_dict(summary.frames) for row in summary.objects}
    assert list(rows) == [("Buch", 0), ("Buch", 1), ("Dose", 0)]
    found = rows["Buch", 1]
    assert (found["frames"], found["frames_found"], found["mean_inliers"]) == (3, 2, 66)
    assert found["median_distance"] == pytest.approx(np.sqrt(0.1**2 + 0.05**2 + 0.7**2))
    assert found["last"] == detection_to_dict(detection(pose=False))
    assert rows["Dose", 0] == {
        "name": "Dose",
        "instance": 0,
        "frames": 3,
        "frames_found": 0,
        "mean_inliers": None,
        "median_distance": None,
        "last": None,
    }
