import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from planegrasp.body import BoxBody
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.library import ObjectLibrary

T_BASE_OBJECT = RigidTransform.from_components(
    [0.7, -0.2, 0.8], Rotation.from_rotvec([0.1, 0.4, -0.3])
)
# The carton is 0.15 × 0.1 × 0.1 m: from its right, fingers along its z, 5 mm inside of the edge.
T_OBJECT_GRIPPER = RigidTransform.from_components(
    [0.07, 0.0, 0.0], Rotation.from_matrix(np.column_stack([[-1, 0, 0], [0, 0, 1], [0, 1, 0]]))
)


@pytest.fixture
def run(run):
    return partial(run, "grasp")


@pytest.fixture(autouse=True)
def library(tmp_path, book, carton):
    made = ObjectLibrary(tmp_path / "objects")
    made.add(book)
    made.add(carton)
    made.save()
    return made


def write_shown(path, T_object_gripper=T_OBJECT_GRIPPER, **more):
    content = {
        "T_base_object": T_BASE_OBJECT.as_matrix().tolist(),
        "T_base_gripper": (T_BASE_OBJECT * T_object_gripper).as_matrix().tolist(),
        "opening": 0.11,
    }
    path.write_text(json.dumps({**content, **more}))
    return path


@pytest.fixture
def shown(tmp_path):
    return write_shown(tmp_path / "shown.json")


def grasps():
    return ObjectLibrary("objects")["carton"].grasps


def test_a_shown_grasp_is_stored(run, shown):
    code, out, _ = run("teach", "carton", "side", "--poses", shown)
    assert code == 0
    assert "carton side: gripper at 70.0, 0.0, 0.0 mm in the object" in out
    (grasp,) = grasps()
    np.testing.assert_allclose(
        grasp.T_object_gripper.as_matrix(), T_OBJECT_GRIPPER.as_matrix(), atol=1e-12
    )
    assert (grasp.name, grasp.opening, grasp.force) == ("side", 0.11, 40.0)


def test_options_go_before_the_file(run, tmp_path):
    shown = write_shown(tmp_path / "s.json", force=12.0, pregrasp_distance=0.2)
    code, out, _ = run(
        "teach", "carton", "side", "--poses", shown, "--opening", 0.12, "--approach", "0.6,0,-0.8",
        "--force", 30, "--json",
    )  # fmt: skip
    result = json.loads(out)
    assert code == 0
    assert (result["library"], result["object"]) == ("objects", "carton")
    (row,) = result["grasps"]
    np.testing.assert_allclose(row["T_object_gripper"]["translation"], [0.07, 0, 0], atol=1e-12)
    (grasp,) = grasps()
    assert (grasp.opening, grasp.approach) == (0.12, (0.6, 0.0, -0.8))
    assert (grasp.force, grasp.pregrasp_distance) == (30.0, 0.2)


def test_symmetric_variants_are_stored(run, shown):
    code, out, _ = run("teach", "carton", "side", "--poses", shown, "--symmetric", "z, gripper")
    assert code == 0
    assert "side/z/flipped" in out
    assert [g.name for g in grasps()] == ["side", "side/flipped", "side/z", "side/z/flipped"]
    np.testing.assert_allclose(grasps()[2].T_object_gripper.translation, [-0.07, 0, 0], atol=1e-12)


def test_replacing_must_be_asked_for_and_takes_the_variants(run, tmp_path, shown):
    run("teach", "carton", "side", "--poses", shown, "--symmetric", "gripper")
    run("teach", "carton", "sideways", "--poses", shown)
    code, _, err = run("teach", "carton", "side", "--poses", shown)
    assert code == 1
    assert "'carton' has a grasp 'side' already: --replace it" in err
    assert run("teach", "carton", "side", "--poses", shown, "--replace")[0] == 0
    assert [g.name for g in grasps()] == ["sideways", "side"]


def test_a_grasp_through_the_object_is_refused_unless_unchecked(run, tmp_path):
    deep = RigidTransform.from_translation([-0.08, 0, 0]) * T_OBJECT_GRIPPER
    shown = write_shown(tmp_path / "deep.json", deep)
    code, _, err = run("teach", "carton", "side", "--poses", shown)
    assert code == 1
    assert "palm 25.0 mm inside of the object" in err
    assert grasps() == []
    assert run("teach", "carton", "side", "--poses", shown, "--unchecked")[0] == 0
    assert len(grasps()) == 1


def test_an_object_is_symmetric_about_its_bodys_centre(run, tmp_path, library):
    box = library["carton"]
    library.add(replace(box, body=BoxBody((0.15, 0.1, 0.1), (0.0, 0.0, 0.004))), replace=True)
    library.save()
    shown = write_shown(tmp_path / "off.json", opening=0.105)
    # About the body's centre, 4 mm in front of the origin, the gripper lies at z = 8 mm then.
    assert run("teach", "carton", "side", "--poses", shown, "--symmetric", "y")[0] == 0
    np.testing.assert_allclose(
        grasps()[1].T_object_gripper.translation, [-0.07, 0, 0.008], atol=1e-12
    )


def test_grasps_are_listed_and_shown(run, shown):
    assert run("list")[:2] == (0, "no grasps; teach one with `planegrasp grasp teach`\n")
    run("teach", "carton", "side", "--poses", shown, "--symmetric", "gripper")
    code, out, _ = run("list")
    assert code == 0
    for text in ("carton", "side/flipped", "70.0, 0.0, 0.0", "110.0", "40"):
        assert text in out
    assert "book" not in out
    rows = json.loads(run("list", "--json")[1])["objects"]
    assert [(row["name"], len(row["grasps"])) for row in rows] == [("book", 0), ("carton", 2)]
    rows = json.loads(run("list", "book", "--json")[1])["objects"]
    assert [row["name"] for row in rows] == ["book"]
    code, out, _ = run("show", "carton", "side", "--json")
    row = json.loads(out)
    assert row["object"] == "carton"
    assert (row["name"], row["opening"], row["approach"]) == ("side", 0.11, [1.0, 0.0, 0.0])
    code, out, _ = run("show", "carton", "side")
    assert code == 0
    # The quaternion of a half turn has two signs, and rounding chooses.
    assert out.replace("-", "") == (
        "carton side\n"
        "gripper in the object, m  0.0700, 0.0000, 0.0000\n"
        "quaternion x, y, z, w     0.0000, 0.7071, 0.7071, 0.0000\n"
        "opening, m                0.1100\n"
        "approach, gripper's frame 1.000, 0.000, 0.000\n"
        "pregrasp distance, m      0.1000\n"
        "force, N                  40\n"
    )


def test_removing_takes_the_variants_along(run, shown):
    run("teach", "carton", "side", "--poses", shown, "--symmetric", "gripper")
    run("teach", "carton", "sideways", "--poses", shown)
    code, out, _ = run("remove", "carton", "side/flipped")
    assert (code, out) == (0, "removed side/flipped of carton\n")
    run("teach", "carton", "side", "--poses", shown, "--symmetric", "gripper", "--replace")
    code, out, _ = run("remove", "carton", "side", "--json")
    assert code == 0
    assert json.loads(out)["removed"] == ["side", "side/flipped"]
    assert [g.name for g in grasps()] == ["sideways"]


def test_a_grasp_is_adapted_to_where_the_object_is_now(run, tmp_path, shown):
    run("teach", "carton", "side", "--poses", shown)
    T_base_camera = RigidTransform.from_components([0.2, 0, 1.5], Rotation.from_rotvec([2.0, 0, 0]))
    T_now = RigidTransform.from_components([0.5, 0.3, 0.9], Rotation.from_rotvec([0, 0, 2.0]))
    (tmp_path / "now.json").write_text(json.dumps({"T_base_object": T_now.as_matrix().tolist()}))
    (tmp_path / "seen.json").write_text(
        json.dumps(
            {
                "T_base_camera": T_base_camera.as_matrix().tolist(),
                "T_camera_object": (T_base_camera.inv() * T_now).as_matrix().tolist(),
            }
        )
    )
    expected = T_now * T_OBJECT_GRIPPER
    for name in ("now.json", "seen.json"):
        code, out, _ = run("adapt", "carton", "side", "--pose", name, "--json")
        assert code == 0
        (row,) = json.loads(out)["grasps"]
        np.testing.assert_allclose(row["T_base_gripper"], expected.as_matrix(), atol=1e-12)
        np.testing.assert_allclose(row["translation"], expected.translation, atol=1e-12)
        np.testing.assert_allclose(
            row["euler"], expected.rotation.as_euler("ZYX")[::-1], atol=1e-12
        )
        back = np.array(row["T_base_pregrasp"])[:3, 3] - expected.translation
        np.testing.assert_allclose(back, -0.1 * expected.as_matrix()[:3, 0], atol=1e-12)
    code, out, _ = run("adapt", "carton", "--pose", "now.json")
    assert code == 0
    phi, theta, psi = np.degrees(expected.rotation.as_euler("ZYX"))[::-1]
    assert f"{phi:.1f}, {theta + 0.0:.1f}, {psi:.1f}" in out.replace("-0.0", "0.0")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("teach", "carton", "side"), "Give --poses FILE"),
        (("teach", "carton", "side", "--poses", "no.toml"), "there is no pose file no.toml"),
        (("teach", "lamp", "side", "--poses", "shown.json"), "no object 'lamp'"),
        (("teach", "carton", "a b", "--poses", "shown.json"), "'a b' cannot be the name of a gra"),
        (("teach", "carton", "side", "--poses", "half.json"), "must say where both are"),
        (("teach", "carton", "side", "--poses", "bare.json"), "Give --opening in metres"),
        (
            ("teach", "carton", "side", "--poses", "shown.json", "--opening", 62),
            "is it in millimetres (0.062 m)?",
        ),
        (
            ("teach", "carton", "side", "--poses", "shown.json", "--symmetric", "z,w"),
            "--symmetric takes gripper, x, y and z, got 'w'",
        ),
        (
            ("teach", "carton", "side", "--poses", "shown.json", "--approach", "1,0"),
            "--approach takes 3 numbers",
        ),
        (("list", "lamp"), "no object 'lamp'"),
        (("show", "carton", "side"), "'carton' has no grasp 'side'; it has: none was taught"),
        (("remove", "carton", "side"), "'carton' has no grasp 'side'"),
        (("adapt", "carton", "side", "--pose", "shown.json"), "'carton' has no grasp 'side'"),
        (("adapt", "carton", "--pose", "shown.json"), "teach one with `planegrasp grasp teach`"),
    ],
)
def test_errors_are_explained(run, tmp_path, shown, arguments, message):
    matrix = np.eye(4).tolist()
    (tmp_path / "half.json").write_text(json.dumps({"T_base_object": matrix, "opening": 0.1}))
    (tmp_path / "bare.json").write_text(
        json.dumps({"T_base_object": matrix, "T_base_gripper": matrix})
    )
    code, out, err = run(*arguments)
    assert code == 1
    assert err.startswith("error: ")
    assert message in err
    assert out == ""
    assert grasps() == []


def test_a_pose_file_without_the_object_is_refused(run, tmp_path, shown):
    run("teach", "carton", "side", "--poses", shown)
    (tmp_path / "now.toml").write_text("")
    code, _, err = run("adapt", "carton", "--pose", "now.toml")
    assert code == 1
    assert "now.toml does not say where the object is: give T_base_object, or" in err
