"""Grasps and bodies are stored with their objects, and can be edited by hand."""

from dataclasses import replace

import numpy as np
import pytest
from library_files import edit, snapshot

from planegrasp.body import BoxBody
from planegrasp.errors import GraspError, LibraryError, SchemaVersionError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.grasping import CanonicalGrasp
from planegrasp.library import ObjectLibrary
from planegrasp.objects import ObjectModel, PlanarFace

SIDE = CanonicalGrasp(
    "side",
    RigidTransform.from_components([0.1, -0.02, 0.03], Rotation.from_rotvec([0.3, -2.0, 1.0])),
    0.062,
    (0.6, 0.0, -0.8),
    0.12,
    25.0,
)
TOP = CanonicalGrasp("top/flipped", np.eye(4), 0.05)


def values(grasp):
    pose = grasp.T_object_gripper.as_matrix().round(12).tolist()
    return (
        grasp.name, pose, grasp.opening, grasp.approach, grasp.pregrasp_distance, grasp.force
    )  # fmt: skip


@pytest.fixture
def folder(tmp_path, book, carton):
    """A saved library with a book that has two grasps and a carton that has none."""
    library = ObjectLibrary(tmp_path / "objects")
    book.grasps.extend([SIDE, TOP])
    library.add(book)
    library.add(carton)
    library.save()
    return tmp_path / "objects"


def changed(before, after):
    paths = before.keys() | after.keys()
    return {path.name for path in paths if before.get(path) != after.get(path)}


def test_grasps_come_back_as_they_were(folder):
    library = ObjectLibrary(folder)
    assert [values(g) for g in library["book"].grasps] == [values(SIDE), values(TOP)]
    assert library["carton"].grasps == []
    assert not (folder / "carton" / "grasps.toml").exists()


def test_a_grasp_is_found_by_its_name(folder):
    book = ObjectLibrary(folder)["book"]
    assert book.grasp("top/flipped") is book.grasps[1]
    with pytest.raises(GraspError, match="'book' has no grasp 'lid'; it has: side, top/flipped"):
        book.grasp("lid")


def test_an_object_without_grasps_says_so(carton):
    with pytest.raises(GraspError, match="no grasp 'lid'; it has: none was taught"):
        carton.grasp("lid")


def test_appending_a_grasp_changes_its_file_alone(folder):
    library = ObjectLibrary(folder)
    before = snapshot(folder)
    library.save()
    assert changed(before, snapshot(folder)) == set()
    library["book"].grasps.append(replace(TOP, name="lid"))
    library.save()
    assert changed(before, snapshot(folder)) - {"book"} == {"grasps.toml"}
    assert [g.name for g in ObjectLibrary(folder)["book"].grasps] == ["side", "top/flipped", "lid"]
    library["carton"].grasps.append(SIDE)
    library.save()
    assert [values(g) for g in ObjectLibrary(folder)["carton"].grasps] == [values(SIDE)]


def test_removing_grasps_is_stored(folder):
    library = ObjectLibrary(folder)
    del library["book"].grasps[0]
    library.save()
    assert [g.name for g in ObjectLibrary(folder)["book"].grasps] == ["top/flipped"]
    library["book"].grasps.clear()
    library.save()
    assert ObjectLibrary(folder)["book"].grasps == []
    library["book"].grasps.append(SIDE)
    library.save()
    assert [values(g) for g in ObjectLibrary(folder)["book"].grasps] == [values(SIDE)]


def test_the_order_of_grasps_is_stored(folder):
    library = ObjectLibrary(folder)
    library["book"].grasps.reverse()
    library.save()
    assert [g.name for g in ObjectLibrary(folder)["book"].grasps] == ["top/flipped", "side"]


def test_saving_grasps_leaves_what_others_changed_of_the_object(folder, photo):
    """A grasp that is added here must not undo an edit, or take away an image put in there."""
    library = ObjectLibrary(folder)
    other = ObjectLibrary(folder)
    anew = PlanarFace("front", photo("chelsea", width=150), 0.21)
    other.add(ObjectModel("book", (anew,), 5, None, other["book"].grasps), replace=True)
    other.save()
    library["book"].grasps.append(replace(TOP, name="lid"))
    library.save()
    book = ObjectLibrary(folder)["book"]
    assert (book.priority, len(book.grasps)) == (5, 3)
    assert book.faces[0].image_digest == anew.image_digest


def test_a_copy_has_grasps_of_its_own(folder):
    book = ObjectLibrary(folder)["book"]
    copy = replace(book, priority=3)
    copy.grasps.pop()
    assert len(book.grasps) == 2


def test_a_further_face_keeps_grasps_and_body(folder, photo):
    library = ObjectLibrary(folder)
    body = BoxBody((0.21, 0.14, 0.02), (0.0, 0.0, -0.01))
    book = replace(library["book"], body=body)
    library.add(book.with_face(PlanarFace("back", photo("chelsea", width=80), 0.21)), replace=True)
    library.save()
    again = ObjectLibrary(folder)["book"]
    assert [values(g) for g in again.grasps] == [values(SIDE), values(TOP)]
    assert again.body == body
    assert len(again.faces) == 2


def test_bodies_come_back_as_they_were(folder, carton):
    library = ObjectLibrary(folder)
    assert library["book"].body is None
    assert library["carton"].body == carton.body == BoxBody((0.15, 0.1, 0.1))
    library.add(replace(library["carton"], body=None), replace=True)
    library.save()
    assert ObjectLibrary(folder)["carton"].body is None
    assert "body" not in (folder / "carton" / "object.toml").read_text()


def test_a_library_of_before_there_were_bodies_is_read(folder):
    edit(folder / "book" / "object.toml", "schema_version = 2", "schema_version = 1")
    (folder / "book" / "grasps.toml").unlink()
    library = ObjectLibrary(folder)
    assert (library["book"].body, library["book"].grasps) == (None, [])
    library["book"].grasps.append(SIDE)
    library.add(replace(library["book"], priority=2), replace=True)
    library.save()
    assert "schema_version = 2" in (folder / "book" / "object.toml").read_text()
    assert len(ObjectLibrary(folder)["book"].grasps) == 1


def test_names_are_checked_before_anything_is_written(folder):
    library = ObjectLibrary(folder)
    library["carton"].grasps.append(TOP)
    library["book"].grasps.append(replace(TOP, name="Side"))
    before = snapshot(folder)
    with pytest.raises(GraspError, match="'book' has two grasps named 'Side'"):
        library.save()
    library["book"].grasps[-1] = np.eye(4)
    with pytest.raises(GraspError, match="must be CanonicalGrasp, got ndarray"):
        library.save()
    assert changed(before, snapshot(folder)) == set()


# Editing by hand


def test_comments_and_layout_survive(folder):
    path = folder / "book" / "grasps.toml"
    edit(path, 'name = "side"', '# from the right\nname = "side" # the best')
    edit(path, "force = 25.0 # N", "force   =  25 # gently, N")
    library = ObjectLibrary(folder)
    side = library["book"].grasps[0]
    library["book"].grasps[0] = replace(side, opening=0.07)
    library["book"].grasps.append(replace(TOP, name="lid"))
    library.save()
    text = path.read_text()
    assert '# from the right\nname = "side" # the best' in text
    assert "force   =  25 # gently, N" in text
    assert "opening = 0.07 # m, between the fingertips" in text


def test_edited_values_are_read_and_defaults_may_be_left_out(folder):
    (folder / "book" / "grasps.toml").write_text(
        "schema_version = 1\n[[grasps]]\nname = 'a'\ntranslation = [0, 0.1, 0]\n"
        "quaternion = [0, 0, 0.7071, 0.7071]\nopening = 0.03\n"
    )
    (grasp,) = ObjectLibrary(folder)["book"].grasps
    assert (grasp.approach, grasp.pregrasp_distance, grasp.force) == ((1, 0, 0), 0.1, 40.0)
    np.testing.assert_allclose(grasp.T_object_gripper.apply([1, 0, 0]), [0, 1.1, 0], atol=1e-4)


DAMAGE = {
    "broken TOML": ("opening = 0.05", "opening = = 0.05", "not valid TOML.*line"),
    "no version": ("schema_version = 1", "", "schema_version must be an integer from 1 to 1"),
    "newer": ("schema_version = 1", "schema_version = 2", "version 2, this planegrasp reads up to"),
    "unknown key": ("force = 40.0", "forze = 40.0", r"unknown key grasps\[1\]\.forze"),
    "missing key": ("opening = 0.05", "", r"grasps\[1\]\.opening is missing"),
    "text": ("opening = 0.05", 'opening = "wide"', r"grasps\[1\]\.opening: .*'wide'"),
    "too wide": ("opening = 0.05", "opening = 50.0", "grasp 'top/flipped': opening must be .* 50"),
    "no number": ("opening = 0.05", "opening = nan", r"grasps\[1\]\.opening: .*finite"),
    "short quaternion": ("[0.0, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.0, 0.5]", "has length 0.5"),
    "bad approach": ("[1.0, 0.0, 0.0]", "[2.0, 0.0, 0.0]", "approach must be a unit vector"),
    "far away": ("translation = [0.0,", "translation = [7.0,", "7 m away from the object"),
    "same name": ('"top/flipped"', '"side"', "two grasps named 'side'"),
    "bad name": ('"top/flipped"', '"on top"', "'on top' cannot be the name of a grasp"),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_damage_is_named(folder, kind):
    old, new, message = DAMAGE[kind]
    path = folder / "book" / "grasps.toml"
    edit(path, old, new)
    with pytest.raises(LibraryError, match=message) as caught:
        ObjectLibrary(folder)
    assert str(path) in str(caught.value)
    assert isinstance(caught.value, SchemaVersionError) == (kind == "newer")


def test_a_file_that_is_not_text_is_named(folder):
    (folder / "book" / "grasps.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(LibraryError, match=r"grasps\.toml cannot be read"):
        ObjectLibrary(folder)


def test_a_body_of_no_size_is_named(folder):
    edit(folder / "carton" / "object.toml", "size = [0.15, 0.1, 0.1]", "size = [0.15, 0.0, 0.1]")
    with pytest.raises(LibraryError, match=r"object\.toml: size of a body must be > 0 m"):
        ObjectLibrary(folder)


def test_an_edit_to_nonsense_while_the_library_is_open_is_not_overwritten(folder):
    library = ObjectLibrary(folder)
    path = folder / "book" / "grasps.toml"
    edit(path, "opening = 0.05", "opening = [ half an edit")
    before = path.read_text()
    library["book"].grasps.pop()
    with pytest.raises(LibraryError, match="not valid TOML"):
        library.save()
    assert path.read_text() == before
