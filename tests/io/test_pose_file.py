import json

import numpy as np
import pytest

from planegrasp.errors import SourceError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.io.pose_file import read_poses

T_BASE_CAMERA = RigidTransform.from_components([0.3, 0, 1.2], Rotation.from_euler("x", 2.0))
T_CAMERA_OBJECT = RigidTransform.from_components([0, 0.1, 0.7], Rotation.from_euler("y", 1.0))


def components(T):
    return {"translation": T.translation.tolist(), "quaternion": T.rotation.as_quat().tolist()}


def write(path, **content):
    path.write_text(json.dumps(content))
    return path


def test_toml_with_both_forms_of_a_pose(tmp_path):
    (tmp_path / "shown.toml").write_text(
        "T_base_object = {translation = [0.6, 0, 0.8], quaternion = [0, 0, 0, 1]}\n"
        "T_base_gripper = [[0, -1, 0, 0.5], [1, 0, 0, 0.1], [0, 0, 1, 0.8], [0, 0, 0, 1]]\n"
        "opening = 0.062\napproach = [0, 0, 1]\n"
    )
    poses = read_poses(str(tmp_path / "shown.toml"))
    np.testing.assert_allclose(poses.T_base_object.translation, [0.6, 0, 0.8])
    np.testing.assert_allclose(poses.T_base_gripper.apply([1, 0, 0]), [0.5, 1.1, 0.8])
    assert poses.how == {"opening": 0.062, "approach": (0.0, 0.0, 1.0)}


def test_json_with_camera_and_object(tmp_path):
    path = write(
        tmp_path / "now.json",
        T_base_camera=components(T_BASE_CAMERA),
        T_camera_object=T_CAMERA_OBJECT.as_matrix().tolist(),
    )
    poses = read_poses(path)
    expected = T_BASE_CAMERA.as_matrix() @ T_CAMERA_OBJECT.as_matrix()
    np.testing.assert_allclose(poses.T_base_object.as_matrix(), expected, atol=1e-12)
    assert poses.T_base_gripper is None
    assert poses.how == {}


def test_an_empty_file_says_nothing(tmp_path):
    (tmp_path / "a.toml").write_text("")
    assert read_poses(tmp_path / "a.toml").T_base_object is None


IDENTITY = np.eye(4).tolist()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"T_object_base": IDENTITY}, "unknown key T_object_base; there are T_base_object, "),
        ({"T_base_object": [1, 2, 3]}, "T_base_object must be a 4×4 matrix, or {translation"),
        ({"T_base_object": {"translation": [0, 0, 0]}}, "T_base_object must be a 4×4 matrix, or"),
        (
            {"T_base_object": {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}},
            "T_base_object must be a 4×4 matrix, or",
        ),
        ({"T_base_object": np.diag([1.0, 1, 2, 1]).tolist()}, "T_base_object: .*be a rotation"),
        (
            {"T_base_object": {"translation": [0, 0, 0], "quaternion": [0, 0, 0, 2]}},
            "T_base_object: quaternion .* has length 2, a rotation has 1",
        ),
        ({"opening": "wide"}, "opening: .*number.*, got 'wide'"),
        ({"T_camera_object": IDENTITY}, "T_camera_object needs T_base_camera, too"),
        (
            {f"T_{key}": IDENTITY for key in ("base_object", "base_camera", "camera_object")},
            "give T_base_object, or T_base_camera and T_camera_object, not both",
        ),
    ],
)
def test_what_is_wrong_is_named(tmp_path, content, message):
    path = write(tmp_path / "poses.json", **content)
    with pytest.raises(SourceError, match=message) as caught:
        read_poses(path)
    assert str(path) in str(caught.value)


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(SourceError, match=r"there is no pose file .*nothing\.toml"):
        read_poses(tmp_path / "nothing.toml")
    (tmp_path / "a.json").write_text("{")
    with pytest.raises(SourceError, match=r"a\.json is not JSON"):
        read_poses(tmp_path / "a.json")
    (tmp_path / "a.json").write_text("[]")
    with pytest.raises(SourceError, match=r"a\.json: the file: "):
        read_poses(tmp_path / "a.json")
    (tmp_path / "a.txt").write_text('{"opening": 1}')
    with pytest.raises(SourceError, match=r"a\.txt is not TOML \(for JSON call it \.json\)"):
        read_poses(tmp_path / "a.txt")
    (tmp_path / "b.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(SourceError, match=r"b\.toml cannot be read"):
        read_poses(tmp_path / "b.toml")
