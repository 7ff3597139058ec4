"""What README and docs show really runs, and what they link to exists."""

import re
import runpy
import shlex
from pathlib import Path

import pytest

from planegrasp.cli import main

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\]\(([^)\s]+)\)")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """The tutorial's photos and recording."""
    folder = tmp_path_factory.mktemp("data")
    runpy.run_path(str(ROOT / "examples" / "tutorial_data.py"))["main"](folder)
    return folder


@pytest.fixture
def inside(data, tmp_path, monkeypatch):
    """Work in a new folder that holds the tutorial's data."""
    for entry in data.iterdir():
        (tmp_path / entry.name).symlink_to(entry)
    monkeypatch.chdir(tmp_path)


def commands(block):
    """The planegrasp commands of a shell block, as lists of arguments."""
    for line in block.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words[:1] == ["planegrasp"]:
            yield words[1:]


@pytest.mark.parametrize(
    ("page", "ran"),
    [
        ("README.md", 11),
        ("docs/tutorial.md", 16),
        ("docs/conventions.md", 1),
        ("docs/robots.md", 4),
        ("docs/cameras.md", 3),
        ("docs/live.md", 3),
        ("docs/foxglove.md", 5),
        ("docs/ros2.md", 4),
    ],
)
@pytest.mark.usefixtures("inside")
def test_blocks_run(page, ran, capsys):
    names = {}
    count = 0
    for language, block in _BLOCK.findall((ROOT / page).read_text()):
        if language == "python":
            exec(compile(block, page, "exec"), names)
            count += 1
        for arguments in commands(block) if language == "bash" else ():
            with pytest.raises(SystemExit) as left:
                main(arguments)
            assert not left.value.code, (arguments, capsys.readouterr().err)
            count += 1
    assert count == ran


def anchors(page):
    """The anchors of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    for link in _LINK.findall(page.read_text()):
        path, _, anchor = link.partition("#")
        if "://" in path:
            continue
        target = page.parent / path if path else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link
