import json

import numpy as np
import pytest

from planegrasp.geometry import PinholeCamera
from planegrasp.io.camera_file import write_camera
from planegrasp.io.images import read_color, write_color, write_depth
from planegrasp.library import ObjectLibrary


@pytest.fixture
def coffee(tmp_path, photo):
    write_color(tmp_path / "coffee.png", photo("coffee", width=300))
    return tmp_path / "coffee.png"


def test_teaching_prints_quality_and_saves(run, coffee):
    code, out, _ = run("teach", "book", coffee, "--width", 0.21)
    assert code == 0
    assert "210.0 × 140.0 mm" in out
    assert "quality" in out
    face = ObjectLibrary("objects")["book"].faces[0]
    assert (face.width, face.height) == pytest.approx((0.21, 0.14))


def test_json_has_size_and_quality(run, coffee):
    code, out, _ = run(
        "teach", "book", coffee, "--width", 0.21, "--height", 0.15, "--priority", 4, "--json",
        "--library", "lib", "--face", "cover",
    )  # fmt: skip
    result = json.loads(out)
    assert code == 0
    assert (result["name"], result["face"], result["priority"]) == ("book", "cover", 4)
    assert (result["width"], result["height"], result["image_size"]) == (0.21, 0.15, [300, 200])
    assert result["quality"]["score"] > 50
    assert ObjectLibrary("lib")["book"].priority == 4


@pytest.mark.parametrize("corners", ["50,40 349,40 349,239 50,239", "50,40,349,40,349,239,50,239"])
def test_corners_cut_the_object_out(run, tmp_path, photo, corners):
    scene = np.full((300, 400, 3), 90, np.uint8)
    scene[40:240, 50:350] = photo("coffee", width=300)
    write_color(tmp_path / "scene.png", scene)
    code, out, _ = run("teach", "b", "scene.png", "--width", 0.3, "--corners", corners, "--json")
    assert code == 0
    assert json.loads(out)["height"] == pytest.approx(0.3 * 199 / 299)


def test_width_and_height_are_measured_from_depth(run, tmp_path, photo):
    camera = PinholeCamera(400, 300, 500.0, 500.0, 199.5, 149.5)
    scene = np.full((300, 400, 3), 90, np.uint8)
    scene[50:250, 50:350] = photo("coffee", width=300)
    depth = np.full((300, 400), 1.5, np.float32)
    depth[50:250, 50:350] = 0.8
    write_color(tmp_path / "color.png", scene)
    write_depth(tmp_path / "depth.png", depth, 0.0005)
    write_camera(tmp_path / "camera.json", camera, 0.001)
    arguments = (
        "teach", "book", "color.png", "--depth", "depth.png", "--camera", "camera.json",
        "--corners", "49.5,49.5 349.5,49.5 349.5,249.5 49.5,249.5", "--json", "--replace",
    )  # fmt: skip
    code, out, _ = run(*arguments, "--depth-scale", 0.0005)
    result = json.loads(out)
    assert code == 0
    assert (result["width"], result["height"]) == pytest.approx((0.48, 0.32), rel=1e-3)
    # The camera file's own scale would make everything twice as large.
    assert json.loads(run(*arguments)[1])["width"] == pytest.approx(0.96, rel=1e-3)


def test_a_further_side_of_a_box_is_added(run, coffee):
    assert run("teach", "tea", coffee, "--box", "0.15,0.10,0.10")[0] == 0
    code, out, _ = run("teach", "tea", coffee, "--box", "0.15 0.1 0.1", "--face", "top", "--json")
    assert code == 0
    assert (json.loads(out)["width"], json.loads(out)["height"]) == (0.15, 0.1)
    box = ObjectLibrary("objects")["tea"]
    assert [face.name for face in box.faces] == ["front", "top"]
    np.testing.assert_allclose(box.face("top").T_object_face.translation, [0, 0.05, 0])


def test_a_further_face_at_a_given_pose_is_added(run, coffee):
    run("teach", "tea", coffee, "--width", 0.15)
    code, *_ = run(
        "teach", "tea", coffee, "--width", 0.15, "--face", "lid", "--pose", "0,0.05,0.1,0,0,1,0"
    )
    assert code == 0
    lid = ObjectLibrary("objects")["tea"].face("lid")
    np.testing.assert_allclose(lid.T_object_face.translation, [0, 0.05, 0.1])
    np.testing.assert_allclose(lid.T_object_face.rotation.as_quat(), [0, 0, 1, 0])


def test_replacing_needs_to_be_asked_for_and_keeps_the_priority(run, coffee, tmp_path, photo):
    run("teach", "book", coffee, "--width", 0.21, "--priority", 2)
    write_color(tmp_path / "cat.png", photo("chelsea", width=300))
    code, _, err = run("teach", "book", "cat.png", "--width", 0.3)
    assert code == 1
    assert "has a face 'front' already: --replace it" in err
    assert ObjectLibrary("objects")["book"].faces[0].width == 0.21
    assert run("teach", "book", "cat.png", "--width", 0.3, "--replace")[0] == 0
    model = ObjectLibrary("objects")["book"]
    assert (model.faces[0].width, model.priority) == (0.3, 2)


def test_the_body_is_taught_with_the_face(run, coffee):
    _, out, _ = run("teach", "book", coffee, "--width", 0.21, "--thickness", 0.02, "--json")
    assert json.loads(out)["body"] == {"size": [0.21, 0.14, 0.02], "centre": [0.0, 0.0, -0.01]}
    body = ObjectLibrary("objects")["book"].body
    assert (body.size, body.centre) == ((0.21, 0.14, 0.02), (0.0, 0.0, -0.01))
    # A face of another size has a body of that size, as thick as before.
    run("teach", "book", coffee, "--width", 0.3, "--replace")
    assert ObjectLibrary("objects")["book"].body.size == pytest.approx((0.3, 0.2, 0.02))
    run("teach", "book", coffee, "--width", 0.3, "--replace", "--thickness", 0.03)
    assert ObjectLibrary("objects")["book"].body.size == pytest.approx((0.3, 0.2, 0.03))


def test_without_a_thickness_there_is_no_body(run, coffee):
    run("teach", "book", coffee, "--width", 0.21)
    model = ObjectLibrary("objects")["book"]
    assert model.body is None
    assert model.outer_body.size == pytest.approx((0.21, 0.14, 0.005))


def test_a_box_is_its_own_body(run, coffee):
    run("teach", "tea", coffee, "--box", "0.15,0.10,0.12", "--face", "back")
    body = ObjectLibrary("objects")["tea"].body
    assert (body.size, body.centre) == ((0.15, 0.10, 0.12), (0.0, 0.0, 0.0))


def test_replacing_a_face_keeps_a_body_of_another_shape(run, coffee):
    run("teach", "tea", coffee, "--box", "0.15,0.10,0.12")
    run("teach", "tea", coffee, "--box", "0.15,0.10,0.12", "--face", "top")
    arguments = ("--width", 0.14, "--pose", "0,0,0.06,0,0,0,1", "--replace")
    assert run("teach", "tea", coffee, *arguments)[0] == 0
    assert ObjectLibrary("objects")["tea"].body.size == (0.15, 0.10, 0.12)


def test_the_preview_is_written(run, coffee):
    assert run("teach", "book", coffee, "--width", 0.21, "--preview", "out/seen.png")[0] == 0
    assert min(read_color("out/seen.png").shape[:2]) >= 400


def test_what_cannot_be_recognised_is_refused_with_reasons(run, tmp_path):
    write_color(tmp_path / "plain.png", np.full((200, 300, 3), 200, np.uint8))
    code, _, err = run("teach", "page", "plain.png", "--width", 0.2)
    assert code == 1
    assert err.startswith("error: face 'front' of 'page' cannot be recognised")
    assert "no features" in err
    assert not (tmp_path / "objects").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "how wide is the face"),
        (("--width", 210), "did you mean 0.21 (210 mm)"),
        (("--width", 0.2, "--height", 14), "--height 14 is in metres: did you mean"),
        (("--width", -0.2), "must be > 0 m"),
        (("--width", 0.2, "--height", 0.9), "is the image turned"),
        (("--width", 0.2, "--corners", "1,2 3,4"), "--corners takes 8 numbers"),
        (("--width", 0.2, "--corners", "a,b,c,d,e,f,g,h"), "--corners takes 8 numbers"),
        (("--width", 0.2, "--corners", "9,9 9,150 200,150 200,9"), "counter-clockwise"),
        (("--width", 0.2, "--pose", "0,0,0,1,1,0,0"), "has length 1.414"),
        (("--depth", "d.png"), "needs the --camera file"),
        (("--box", "0.2,0.1"), "--box takes 3 numbers"),
        (("--box", "0.15,0.1,0.1", "--face", "lid"), "a box has no side 'lid'"),
        (("--box", "0.15,0.1,0.1", "--width", 0.2), "leave out --width"),
        (("--box", "0.15,0.1,0.1", "--thickness", 0.1), "leave out --thickness"),
        (("--width", 0.2, "--thickness", 20), "did you mean 0.02 (20 mm)"),
        (("--width", 0.2, "--thickness", 0), "thickness must be > 0 m"),
        (("--box", "150,100,100"), "did you mean 0.15 (150 mm)"),
        (("--width", 0.2, "--face", "a b"), "'a b' cannot be the name of a face"),
    ],
)
def test_wrong_options_are_explained(run, coffee, tmp_path, arguments, message):
    code, out, err = run("teach", "book", coffee, *arguments)
    assert code == 1
    assert message in err
    assert out == ""
    assert not (tmp_path / "objects").exists()


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("nothing.png", None, "there is no file nothing.png"),
        ("text.png", b"hello", "is not an image"),
        ("empty.png", b"", "is empty"),
    ],
)
def test_bad_image_files_are_explained(run, tmp_path, name, content, message):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    code, _, err = run("teach", "book", name, "--width", 0.2)
    assert code == 1
    assert message in err


def test_a_name_that_is_no_folder_name_is_refused(run, coffee):
    code, _, err = run("teach", "a/b", coffee, "--width", 0.2)
    assert code == 1
    assert "'a/b' cannot be the name of an object" in err


def test_a_second_face_without_a_pose_is_refused(run, coffee):
    run("teach", "book", coffee, "--width", 0.2)
    code, _, err = run("teach", "book", coffee, "--width", 0.2, "--face", "back")
    assert code == 1
    assert "say with --pose or --box where face 'back' is" in err
