"""Two files change at one instant, also where a kill came between them."""

import json

import pytest

from planegrasp.errors import LibraryError
from planegrasp.library import ObjectLibrary, journal


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "a.toml").write_text("old a")
    (tmp_path / "b.toml").write_text("old b")
    return tmp_path


def killed(folder, **texts):
    """Leave what a kill right after the instant of the change leaves."""
    (folder / journal.JOURNAL).write_text(json.dumps({f"{k}.toml": v for k, v in texts.items()}))


def contents(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_files_are_replaced_and_no_journal_stays(folder):
    journal.change(folder, {"a.toml": "new a", "b.toml": "new b", "c.toml": "new c"})
    assert contents(folder) == {"a.toml": "new a", "b.toml": "new b", "c.toml": "new c"}


def test_equal_files_are_not_touched(folder):
    before = (folder / "a.toml").stat().st_mtime_ns, (folder / "a.toml").stat().st_ino
    journal.change(folder, {"a.toml": "old a", "b.toml": "new b"})
    assert ((folder / "a.toml").stat().st_mtime_ns, (folder / "a.toml").stat().st_ino) == before
    assert contents(folder) == {"a.toml": "old a", "b.toml": "new b"}


def test_a_reader_sees_the_new_state_before_it_is_carried_out(folder):
    killed(folder, a="new a", c="new c")
    assert journal.read(folder / "a.toml") == "new a"
    assert journal.read(folder / "b.toml") == "old b"
    assert journal.read(folder / "c.toml") == "new c"
    assert journal.read(folder / "d.toml") is None
    assert (folder / "a.toml").read_text() == "old a"


def test_a_killed_change_is_carried_out_once(folder):
    killed(folder, a="new a", c="new c")
    journal.finish(folder)
    assert contents(folder) == {"a.toml": "new a", "b.toml": "old b", "c.toml": "new c"}
    (folder / "a.toml").write_text("an edit")
    journal.finish(folder)
    assert (folder / "a.toml").read_text() == "an edit"


def test_a_further_change_does_not_lose_a_killed_one(folder):
    killed(folder, a="new a", b="new b")
    journal.change(folder, {"b.toml": "newer b"})
    assert contents(folder) == {"a.toml": "new a", "b.toml": "newer b"}


@pytest.mark.parametrize("text", ["{", "[]", '{"a.toml": 3}', '{"../a.toml": "x"}', "\x00"])
def test_a_damaged_journal_is_named(folder, text):
    (folder / journal.JOURNAL).write_text(text)
    with pytest.raises(LibraryError, match=r"save\.json is damaged: delete it"):
        journal.read(folder / "a.toml")


def test_a_damaged_journal_damages_its_object_alone(tmp_path, book, carton):
    library = ObjectLibrary(tmp_path / "objects")
    library.add(book)
    library.add(carton)
    library.save()
    (tmp_path / "objects" / "book" / journal.JOURNAL).write_text("{")
    with pytest.raises(LibraryError, match=r"book/\.planegrasp-save\.json is damaged"):
        ObjectLibrary(tmp_path / "objects")
    library.remove("carton")
    library.save()
    assert not (tmp_path / "objects" / "carton").exists()
