import json
from functools import partial

import numpy as np
import pytest

from planegrasp.grasping import CanonicalGrasp
from planegrasp.library import ObjectLibrary


@pytest.fixture
def run(run):
    return partial(run, "objects")


@pytest.fixture
def library(tmp_path, book, carton):
    made = ObjectLibrary(tmp_path / "objects")
    made.add(book)
    made.add(carton)
    made.save()
    return made


@pytest.fixture
def damaged(library):
    path = library.path / "book" / "object.toml"
    path.write_text(path.read_text().replace("priority", "priorty"))
    return library


@pytest.mark.usefixtures("library")
def test_objects_are_listed(run):
    code, out, _ = run()
    assert code == 0
    for text in ("book", "210.0 × 140.4", "carton", "front", "top", "150.0 × 100.0", "150×100"):
        assert text in out


@pytest.mark.usefixtures("library")
def test_the_list_as_json(run):
    code, out, _ = run("list", "--json")
    result = json.loads(out)
    assert code == 0
    assert [row["name"] for row in result["objects"]] == ["book", "carton"]
    assert result["damaged"] == []
    top = result["objects"][1]["faces"][1]
    assert (top["width"], top["height"], top["image_size"]) == (0.15, 0.1, [150, 100])
    assert top["T_object_face"]["translation"] == [0.0, 0.05, 0.0]


def test_grasps_are_listed(run, library):
    assert "grasps" not in run()[1]
    library["carton"].grasps.append(CanonicalGrasp("side", np.eye(4), 0.062))
    library.save()
    _, out, _ = run()
    assert "grasps" in out
    assert "side" in out
    rows = json.loads(run("--json")[1])["objects"]
    assert rows[0]["grasps"] == []
    (grasp,) = rows[1]["grasps"]
    assert (grasp["name"], grasp["opening"], grasp["force"]) == ("side", 0.062, 40.0)
    assert grasp["T_object_gripper"]["quaternion"] == [0.0, 0.0, 0.0, 1.0]
    assert rows[1]["body"] == {"size": [0.15, 0.1, 0.1], "centre": [0.0, 0.0, 0.0]}


@pytest.mark.usefixtures("library")
def test_one_object_is_shown_with_its_poses(run):
    code, out, _ = run("show", "carton", "--json")
    assert code == 0
    assert [row["name"] for row in json.loads(out)["objects"]] == ["carton"]
    code, out, _ = run("show", "carton")
    assert code == 0
    assert "0.0500" in out
    assert "book" not in out


@pytest.mark.usefixtures("library")
def test_quality_of_all_and_of_one(run):
    _, out, _ = run("quality", "--json")
    faces = json.loads(out)["faces"]
    assert [(row["name"], row["face"]) for row in faces] == [
        ("book", "front"),
        ("carton", "front"),
        ("carton", "top"),
    ]
    assert all(0 < row["quality"]["score"] < 100 for row in faces)
    code, out, _ = run("quality", "book")
    assert code == 0
    assert "low resolution" in out
    assert "carton" not in out


@pytest.mark.usefixtures("library")
def test_an_object_is_removed(run, tmp_path):
    code, out, _ = run("remove", "book")
    assert code == 0
    assert "removed book" in out
    assert ObjectLibrary(tmp_path / "objects").names == ("carton",)


@pytest.mark.usefixtures("damaged")
def test_damage_is_listed_beside_the_good_objects(run):
    code, out, err = run()
    assert code == 1
    assert "carton" in out
    assert "unknown key priorty" in err
    code, out, _ = run("--json")
    assert code == 1
    result = json.loads(out)
    assert [row["name"] for row in result["objects"]] == ["carton"]
    assert "unknown key priorty" in result["damaged"][0]["error"]


@pytest.mark.usefixtures("damaged")
def test_a_damaged_object_can_be_removed(run):
    assert run("show", "book")[0] == 1
    assert run("remove", "book")[0] == 0
    assert run()[0] == 0


def test_an_empty_library_is_not_an_error(run):
    code, out, _ = run("--library", "nowhere")
    assert code == 0
    assert "nowhere does not exist yet" in out


@pytest.mark.usefixtures("library")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("show", "lamp"), "no object 'lamp' in objects; it has: book, carton"),
        (("remove", "lamp"), "no object 'lamp'"),
        (("remove", ".."), "no object '..'"),
        (("remove", "book/cache"), "no object 'book/cache'"),
        (("remove", "lamp", "--library", "nowhere"), "nowhere does not exist"),
        (("show",), "which object? planegrasp objects show NAME"),
        (("remove",), "which object? planegrasp objects remove NAME"),
    ],
)
def test_errors_are_explained(run, arguments, message):
    code, _, err = run(*arguments)
    assert code == 1
    assert err.startswith("error: ")
    assert message in err


def test_a_library_that_is_a_file_is_an_error(run, tmp_path):
    (tmp_path / "objects").write_text("")
    code, _, err = run()
    assert code == 1
    assert "is a file: a library is a folder" in err
