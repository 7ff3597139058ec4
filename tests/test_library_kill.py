"""A kill at any instant of a save leaves the old or the new state: children are really killed."""

import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).with_name("library_kills.py")


def run(*arguments):
    done = subprocess.run(
        [sys.executable, SCRIPT, *map(str, arguments)],
        check=False,
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def assert_clean(files):
    """Only state 0 is left: a box with two sides, and grasps."""
    assert files[0] == "box"
    assert [name.split("-")[0] for name in files[1:]] == [
        "box/back",
        "box/front",
        "box/grasps.toml",
        "box/object.toml",
    ]


def test_kills_at_random_times(tmp_path):
    result = run(tmp_path / "objects", "random", 1, 40)
    assert result["kills"] >= 40
    # Both states were met, and several kills really hit the middle of a save.
    assert {0, 1} <= set(result["states"])
    assert result["interrupted"] >= 5
    assert_clean(result["files"])


def test_kills_before_every_single_change_of_a_file(tmp_path):
    result = run(tmp_path / "objects", "steps")
    assert result["steps"]["new"] >= 8
    assert result["steps"]["change"] >= 10
    assert result["steps"]["remove"] >= 4
    assert result["steps"]["grasps"] >= 2
    states = {"new": (-1, 0), "change": (0, 1), "grasps": (1, 2), "remove": (1, -1)}
    for name, (before, after) in states.items():
        outcomes = result["outcomes"][name]
        # Old until one instant, new from then on.
        switch = outcomes.index(after)
        assert outcomes == [before] * switch + [after] * (len(outcomes) - switch)
        assert switch > 0
    assert_clean(result["files"])
