import os
import stat

import numpy as np
import pytest
from library_files import edit, snapshot

from planegrasp.errors import (
    DuplicateObjectError,
    LibraryError,
    PlanegraspError,
    SchemaVersionError,
    UnknownObjectError,
)
from planegrasp.library import ObjectLibrary, scan
from planegrasp.objects import ObjectModel, PlanarFace


def assert_same(one, other):
    assert (one.name, one.priority) == (other.name, other.priority)
    assert [f.name for f in one.faces] == [f.name for f in other.faces]
    for a, b in zip(one.faces, other.faces, strict=True):
        assert (a.width, a.height, a.image_digest) == (b.width, b.height, b.image_digest)
        np.testing.assert_allclose(
            a.T_object_face.as_matrix(), b.T_object_face.as_matrix(), atol=1e-14
        )


@pytest.fixture
def folder(tmp_path, book, carton):
    """A saved library with a book and a carton."""
    library = ObjectLibrary(tmp_path / "objects")
    library.add(book)
    library.add(carton)
    library.save()
    return tmp_path / "objects"


# The library as a mapping


def test_a_library_gives_back_what_was_saved(folder, book, carton):
    library = ObjectLibrary(folder)
    assert library.names == ("book", "carton")
    assert [model.name for model in library] == ["book", "carton"]
    assert len(library) == 2
    assert "book" in library
    assert "lamp" not in library
    assert_same(library["book"], book)
    assert_same(library["carton"], carton)


def test_a_folder_that_does_not_exist_is_an_empty_library(tmp_path):
    library = ObjectLibrary(tmp_path / "a" / "b")
    assert len(library) == 0
    assert not (tmp_path / "a").exists()
    library.save()
    assert (tmp_path / "a" / "b").is_dir()
    assert ObjectLibrary(tmp_path / "a" / "b").names == ()


def test_objects_come_in_the_order_of_their_names(folder, book):
    library = ObjectLibrary(folder)
    library.add(ObjectModel("atlas", book.faces))
    assert library.names == ("atlas", "book", "carton")


def test_an_unknown_object_is_named_with_the_known_ones(folder):
    with pytest.raises(UnknownObjectError, match="no object 'lamp'; it has: book, carton"):
        ObjectLibrary(folder)["lamp"]
    with pytest.raises(KeyError):
        ObjectLibrary(folder).remove("lamp")


def test_two_objects_of_one_name_are_refused(book):
    library = ObjectLibrary()
    library.add(book)
    with pytest.raises(DuplicateObjectError, match="'book' already: replace it"):
        library.add(book)
    library.add(ObjectModel("book", book.faces, 9), replace=True)
    assert library["book"].priority == 9


def test_names_that_differ_in_case_only_are_refused_even_to_replace(book):
    library = ObjectLibrary()
    library.add(book)
    for replace in (False, True):
        with pytest.raises(DuplicateObjectError, match="more than upper and lower case"):
            library.add(ObjectModel("Book", book.faces), replace=replace)


def test_a_library_in_memory_cannot_be_saved(book):
    library = ObjectLibrary()
    library.add(book)
    assert library.cache_dir("book") is None
    with pytest.raises(LibraryError, match="in memory"):
        library.save()


# Saving


def test_removing_deletes_the_folder(folder):
    library = ObjectLibrary(folder)
    library.remove("book")
    assert (folder / "book").is_dir()
    library.save()
    assert not (folder / "book").exists()
    assert ObjectLibrary(folder).names == ("carton",)


def test_saving_writes_only_what_changed(folder, carton):
    library = ObjectLibrary(folder)
    book_before, carton_before = snapshot(folder / "book"), snapshot(folder / "carton")
    library.add(ObjectModel("carton", carton.faces, 7), replace=True)
    library.save()
    assert snapshot(folder / "book") == book_before
    changed = snapshot(folder / "carton")
    assert {p.name for p in changed if changed[p] != carton_before[p]} == {"object.toml"}
    library.save()
    assert snapshot(folder / "carton") == changed


def test_replacing_an_image_leaves_no_old_files(folder, photo):
    library = ObjectLibrary(folder)
    (folder / "book" / "cache").mkdir()
    (folder / "book" / "cache" / "old.npz").write_bytes(b"x")
    (folder / "book" / "notes.txt").write_text("mine")
    library.add(ObjectModel.from_image("book", photo("chelsea", width=80), 0.1), replace=True)
    library.save()
    names = sorted(p.name for p in (folder / "book").iterdir())
    assert [n for n in names if n.endswith(".png")] == [library_image(folder, "book")]
    assert "cache" not in names
    assert "notes.txt" in names


def library_image(folder, name):
    line = next(
        x for x in (folder / name / "object.toml").read_text().splitlines() if "image =" in x
    )
    return line.split('"')[1]


def test_two_processes_adding_one_name_do_not_overwrite_each_other(folder, book):
    first, second = ObjectLibrary(folder), ObjectLibrary(folder)
    first.add(ObjectModel("lamp", book.faces, 1))
    second.add(ObjectModel("lamp", book.faces, 2))
    first.save()
    with pytest.raises(DuplicateObjectError, match="was created since"):
        second.save()
    assert ObjectLibrary(folder)["lamp"].priority == 1


def test_two_processes_changing_different_objects_keep_both(folder, book, carton):
    first, second = ObjectLibrary(folder), ObjectLibrary(folder)
    first.add(ObjectModel("book", book.faces, 11), replace=True)
    second.add(ObjectModel("carton", carton.faces, 12), replace=True)
    first.save()
    second.save()
    assert [model.priority for model in ObjectLibrary(folder)] == [11, 12]


def test_what_a_killed_save_left_is_cleaned_by_the_next(folder, book):
    stale = folder / ".lamp.0123456789ab.tmp"
    stale.mkdir()
    (stale / "front.png").write_bytes(b"half")
    (folder / "book" / ".object.toml.0123456789ab.tmp").write_text("half")
    (folder / "carton" / "cache").mkdir()
    (folder / "carton" / "cache" / ".key.npz.0123456789ab.tmp").write_text("half")
    (folder / ".keep").write_text("a user's file")
    library = ObjectLibrary(folder)
    assert library.names == ("book", "carton")
    library.add(ObjectModel("book", book.faces, 1), replace=True)
    library.save()
    assert not list(folder.rglob("*.tmp"))
    assert (folder / ".keep").exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_is_an_error(folder, book):
    library = ObjectLibrary(folder)
    library.add(ObjectModel("lamp", book.faces))
    folder.chmod(stat.S_IRUSR | stat.S_IXUSR)
    try:
        with pytest.raises(LibraryError, match="cannot be written"):
            library.save()
    finally:
        folder.chmod(stat.S_IRWXU)


# Editing by hand


def test_comments_and_layout_survive_a_save(folder):
    path = folder / "carton" / "object.toml"
    edit(path, 'name = "carton"', '# the tea box\nname = "carton"')
    edit(path, 'name = "top"', 'name = "top" # the lid')
    edit(path, "priority = 3 # larger is preferred", "priority   =   3  # before the book")
    library = ObjectLibrary(folder)
    model = library["carton"]
    narrower = PlanarFace("front", model.face("front").image, 0.149, 0.1)
    faces = (narrower, model.face("top"))
    library.add(ObjectModel("carton", faces, 3), replace=True)
    library.save()
    text = path.read_text()
    assert "# the tea box\n" in text
    assert 'name = "top" # the lid' in text
    assert "priority   =   3  # before the book" in text
    assert "width = 0.149 # m, along the image's rows" in text


def test_a_changed_value_keeps_its_comment(folder, carton):
    path = folder / "carton" / "object.toml"
    edit(path, "priority = 3 # larger is preferred", "priority = 3 # before the book")
    library = ObjectLibrary(folder)
    library.add(ObjectModel("carton", carton.faces, 4), replace=True)
    library.save()
    assert "priority = 4 # before the book" in path.read_text()


def test_faces_can_be_added_removed_and_reordered_in_the_file(folder, carton):
    path = folder / "carton" / "object.toml"
    edit(path, 'name = "top"', 'name = "top" # the lid')
    library = ObjectLibrary(folder)
    front, top = library["carton"].faces
    back = PlanarFace("back", front.image, front.width, front.height)
    library.add(ObjectModel("carton", (top, back)), replace=True)
    library.save()
    again = ObjectLibrary(folder)["carton"]
    assert [face.name for face in again.faces] == ["top", "back"]
    assert_same(again, library["carton"])
    assert 'name = "top" # the lid' in path.read_text()
    assert "front" not in path.read_text()


def test_edited_values_are_read(folder):
    path = folder / "book" / "object.toml"
    edit(path, "width = 0.21", "width = 0.20")
    edit(
        path,
        'T_object_face = "identity"',
        "T_object_face = {translation = [0, 0, 0.05], quaternion = [0, 0, 0.7071, 0.7071]}",
    )
    face = ObjectLibrary(folder)["book"].faces[0]
    assert face.width == 0.20
    np.testing.assert_allclose(face.T_object_face.translation, [0, 0, 0.05])
    np.testing.assert_allclose(face.T_object_face.rotation.apply([1, 0, 0]), [0, 1, 0], atol=1e-9)


def test_an_image_of_any_name_may_be_put_in_by_hand(folder, carton):
    path = folder / "carton" / "object.toml"
    old = library_image(folder, "carton")
    (folder / "carton" / old).rename(folder / "carton" / "photo.png")
    edit(path, old, "photo.png")
    library = ObjectLibrary(folder)
    library.add(ObjectModel("carton", library["carton"].faces, 8), replace=True)
    library.save()
    assert "photo.png" in path.read_text()
    assert_same(ObjectLibrary(folder)["carton"], library["carton"])


# Damage: each says where and what


def remove_image(folder):
    (folder / "book" / library_image(folder, "book")).unlink()


def truncate_image(folder):
    path = folder / "book" / library_image(folder, "book")
    path.write_bytes(path.read_bytes()[:2000])


def other_image(folder):
    path = folder / "book" / library_image(folder, "book")
    path.write_bytes((folder / "carton" / library_image(folder, "carton")).read_bytes())


def replace_text(old, new):
    return lambda folder: edit(folder / "book" / "object.toml", old, new)


DAMAGE = {
    "broken TOML": (replace_text("priority = 0", "priority = = 0"), r"object\.toml .*TOML.*line 7"),
    "no schema version": (replace_text("schema_version = 2", ""), "schema_version must be"),
    "bad schema version": (
        replace_text("schema_version = 2", 'schema_version = "one"'),
        "must be an integer from 1 to 2, got 'one'",
    ),
    "newer schema": (
        replace_text("schema_version = 2", "schema_version = 12"),
        "schema version 12, this planegrasp reads up to version 2",
    ),
    "unknown key": (replace_text("priority =", "priorty ="), "unknown key priorty"),
    "unknown key of a face": (
        replace_text("height =", "hieght ="),
        r"unknown key faces\[0\]\.hieg",
    ),
    "missing key": (replace_text("width =", "# width ="), r"faces\[0\]\.width is missing"),
    "zero width": (
        replace_text("width = 0.21", "width = 0"),
        r"faces\[0\]\.width: .*greater than 0",
    ),
    "nan width": (replace_text("width = 0.21", "width = nan"), r"width: .*finite"),
    "text for a number": (replace_text("width = 0.21", 'width = "wide"'), r"width: .*'wide'"),
    "no faces": (
        lambda folder: (folder / "book" / "object.toml").write_text(
            'schema_version = 2\nname = "book"\nfaces = []\n'
        ),
        "faces: .*at least 1",
    ),
    "short quaternion": (
        replace_text('"identity"', "{translation = [0, 0, 0], quaternion = [0, 0, 0.5, 0.5]}"),
        "quaternion .* has length 0.7071",
    ),
    "no such pose": (replace_text('"identity"', '"upside down"'), "T_object_face: .*identity"),
    "image elsewhere": (replace_text('image = "', 'image = "../'), r"faces\[0\]\.image"),
    "other name": (replace_text('name = "book"', 'name = "cook"'), "named 'cook' but its folder"),
    "missing image": (remove_image, r"no file .*front-.*\.png"),
    "truncated image": (truncate_image, r"front-.*\.png is a truncated"),
    "other image": (other_image, r"is 150×100 pixels, object.toml says 160×107"),
    "no object.toml": (
        lambda folder: (folder / "book" / "object.toml").unlink(),
        "has no object.toml",
    ),
    "not text": (
        lambda folder: (folder / "book" / "object.toml").write_bytes(b"\xff\xfe\x00"),
        "cannot be read",
    ),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_damage_is_named_and_leaves_the_other_objects_readable(folder, kind):
    damage, message = DAMAGE[kind]
    damage(folder)
    with pytest.raises(LibraryError, match=message) as caught:
        ObjectLibrary(folder)
    assert str(folder / "book") in str(caught.value)
    assert isinstance(caught.value, SchemaVersionError) == (kind == "newer schema")
    found = scan(folder)
    assert list(found.objects) == ["carton"]
    assert list(found.damaged) == ["book"]


def test_all_damaged_objects_are_listed(folder):
    edit(folder / "book" / "object.toml", "schema_version = 2", "schema_version = 3")
    edit(folder / "carton" / "object.toml", "priority", "priorty")
    with pytest.raises(LibraryError, match=r"2 objects of (.|\n)*version 3(.|\n)*priorty"):
        ObjectLibrary(folder)


def test_folders_that_differ_in_case_only_are_damage(folder, book):
    (folder / "book").rename(folder / "spare")
    library = ObjectLibrary(folder.parent / "other")
    library.add(ObjectModel("Carton", book.faces))
    library.save()
    (folder / "spare").rename(folder.parent / "spare")
    (folder.parent / "other" / "Carton").rename(folder / "Carton")
    with pytest.raises(LibraryError, match="differ only in upper and lower case"):
        ObjectLibrary(folder)


def test_a_path_that_is_a_file_is_an_error(tmp_path):
    (tmp_path / "objects").write_text("")
    with pytest.raises(LibraryError, match="is a file: a library is a folder"):
        ObjectLibrary(tmp_path / "objects")


def test_other_files_beside_the_objects_do_not_matter(folder):
    (folder / "README.md").write_text("mine")
    (folder / ".git").mkdir()
    assert ObjectLibrary(folder).names == ("book", "carton")


def test_a_file_damaged_while_the_library_is_open_is_not_overwritten(folder, book):
    library = ObjectLibrary(folder)
    path = folder / "book" / "object.toml"
    edit(path, "priority = 0", "priority = [ half an edit")
    before = path.read_text()
    library.add(ObjectModel("book", book.faces, 5), replace=True)
    with pytest.raises(LibraryError, match="not valid TOML"):
        library.save()
    assert path.read_text() == before


def test_every_error_is_a_planegrasp_error():
    assert issubclass(LibraryError, PlanegraspError)


# The cache folder


def test_the_cache_folder_is_there_only_for_what_is_stored(folder, book):
    library = ObjectLibrary(folder)
    assert library.cache_dir("book") == folder / "book" / "cache"
    library.add(ObjectModel("book", book.faces, 1), replace=True)
    assert library.cache_dir("book") is None
    library.save()
    assert library.cache_dir("book") == folder / "book" / "cache"
    with pytest.raises(UnknownObjectError):
        library.cache_dir("lamp")
