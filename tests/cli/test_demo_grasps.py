"""The half of `planegrasp demo` that grasps: what it prints and writes, and that it fails."""

import importlib
import json
from dataclasses import replace

import numpy as np
import pytest

from planegrasp.cli import main
from planegrasp.demo import grasping
from planegrasp.demo.grasping import ACTS, GraspDemo
from planegrasp.io import read_color
from planegrasp.library import ObjectLibrary
from planegrasp.simulation.objects import cracker_box

TRIPOD = ACTS[0]


def run(*arguments):
    """Exit code of the grasping half."""
    with pytest.raises(SystemExit) as left:
        main(["demo", "--only", "grasp", *map(str, arguments)])
    return left.value.code or 0


@pytest.fixture
def one_act(monkeypatch):
    """Only the tripod, with only the front of the box, to learn within seconds."""

    def shorten(*acts):
        box = cracker_box()
        front = (box.model.face("front"),)
        things = (replace(box, model=replace(box.model, faces=front)),)
        original = GraspDemo

        def make(path, seed=0):
            return original(path, seed, acts, sides=("side", "left"), things=things)

        monkeypatch.setattr(grasping, "GraspDemo", make)

    return shorten


def test_a_grasp_from_teaching_to_lifting(one_act, tmp_path, monkeypatch, capsys):
    pytest.importorskip("rerun")
    monkeypatch.setenv("COLUMNS", "240")
    one_act(TRIPOD)
    assert run("--output", tmp_path) == 0
    text = capsys.readouterr().out
    for part in (
        "cracker-box   side, left: learnt to within 0.",
        "its front tilted by 4",
        "grasp 'side': gripper to 0.6",
        "refused",
        "grasp 'left': unreachable",
        "and held, it slipped by 0.",
        "grasp.png",
        "tripod.rrd",
    ):
        assert part in text
    stored = ObjectLibrary(tmp_path / "objects")["cracker-box"].grasps
    assert [grasp.name for grasp in stored] == ["side", "left"]
    board = read_color(tmp_path / "grasp.png")
    assert board.shape[1] == 1608
    assert (tmp_path / "grasp.png").stat().st_size < 400_000
    assert (tmp_path / "tripod.rrd").stat().st_size > 100_000


def test_a_grasp_that_cannot_be_done_is_a_fault(one_act, tmp_path, capsys):
    one_act(replace(TRIPOD, name="far", position=(1.1, -0.24, 0.88)))
    assert run("--output", tmp_path, "--json") == 1
    captured = capsys.readouterr()
    assert "the cracker-box (far) was not grasped: side: unreachable" in captured.err
    result = json.loads(captured.out)
    (experiment,) = result["grasping"]["experiments"]
    assert not experiment["success"]
    assert experiment["grasp"] is None
    assert set(experiment["reasons"]) == {"side", "left"}
    assert len(result["faults"]) == 1
    # The stages that were not reached are left grey.
    board = read_color(tmp_path / "grasp.png")
    assert np.ptp(board[200, -200:-20].astype(int)) == 0


def test_without_the_extra_there_is_nothing_to_grasp_with(tmp_path, monkeypatch, capsys):
    module = importlib.import_module("planegrasp.cli.demo")
    monkeypatch.setattr(module, "_grasping", lambda path, seed: None)
    assert run("--output", tmp_path) == 1
    assert "planegrasp[robot]" in capsys.readouterr().err


def test_acts_are_the_same_for_the_same_seed():
    robot = grasping.Robot.pr2()
    things = (cracker_box(),)
    first, again = (TRIPOD.setting(robot, things, 3) for _ in range(2))
    np.testing.assert_array_equal(first.T_base_object.as_matrix(), again.T_base_object.as_matrix())
    assert first.seed == again.seed == 3
