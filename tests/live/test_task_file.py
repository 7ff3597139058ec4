"""A task in a file: read, refused, read again when it changes."""

from __future__ import annotations

import pytest

from planegrasp.errors import InvalidInputError, UnknownObjectError
from planegrasp.live import Task, TaskFile, read_task


@pytest.fixture
def path(tmp_path):
    return tmp_path / "task.toml"


def test_what_it_says(path):
    path.write_text("budget = 0.01\nothers = false\n[priorities]\nbook = 2\nbox = 0.5\n")
    assert read_task(path) == Task({"book": 2.0, "box": 0.5}, others=False, budget=0.01)
    path.write_text("")
    assert read_task(path) == Task()
    assert read_task(path, 0.007) == Task(budget=0.007)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("budget = many", "Invalid value"),
        ("budget = -1", "budget of a frame must be > 0 s, got -1"),
        ("budget = '1'", "budget: input should be a valid number, got '1'"),
        ("prioritys = 1", "prioritys: extra inputs are not permitted"),
        ("[priorities]\nbook = 'high'", "priorities.book: .* got 'high'"),
        ("[priorities]\nbook = nan", "the priority of 'book' must be finite"),
    ],
)
def test_what_is_damaged(path, text, message):
    path.write_text(text)
    with pytest.raises(InvalidInputError, match=f"the task .*task.toml: .*{message}"):
        read_task(path)


def test_no_text(path):
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(InvalidInputError, match="can't decode"):
        read_task(path)
    with pytest.raises(InvalidInputError, match="cannot be read: No such file"):
        read_task(path.with_name("none"))


def test_it_is_read_when_it_changes(path):
    file = TaskFile(path, ["book", "box"], 0.02)
    with pytest.raises(InvalidInputError, match="cannot be read"):
        file.changed()
    assert file.changed() is None, "told once"
    path.write_text("[priorities]\nbook = 1\n")
    assert file.changed() == Task({"book": 1.0}, budget=0.02)
    assert file.changed() is None
    path.write_text("[priorities]\nbox = 12\n")
    assert file.changed() == Task({"box": 12.0}, budget=0.02)
    path.write_text("[priorities]\nstranger = 1\n")
    with pytest.raises(UnknownObjectError, match="'stranger', which was not taught"):
        file.changed()
    assert file.changed() is None
    path.unlink()
    with pytest.raises(InvalidInputError, match="cannot be read"):
        file.changed()
    path.write_text("")
    assert file.changed() == Task(budget=0.02)
