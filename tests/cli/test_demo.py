"""`planegrasp demo`: what it prints and writes, and that it fails when it should."""

import importlib
import json
import math
from itertools import pairwise

import numpy as np
import pytest

from planegrasp.cli import main
from planegrasp.demo import Comparison, Demo, ObjectScore, scoring
from planegrasp.demo.objects import demo_objects
from planegrasp.demo.scene import poses, shots
from planegrasp.detector import Detector
from planegrasp.geometry import RigidTransform, Rotation, rotation_angle
from planegrasp.io import read_color
from planegrasp.io.sources import open_source
from planegrasp.library import ObjectLibrary
from planegrasp.simulation import Rectangle


def run(*arguments):
    """Exit code of a command."""
    with pytest.raises(SystemExit) as exit_:
        main(["demo", *map(str, arguments)])
    return exit_.value.code


def test_what_it_prints_and_writes(tmp_path, monkeypatch, capsys):
    # One run for all of it: teaching and searching take seconds.
    monkeypatch.setenv("COLUMNS", "240")  # so that no path is folded
    path = tmp_path / "out"
    (path / "found").mkdir(parents=True)
    (path / "found" / "frame-099.png").write_bytes(b"of an earlier run")
    # As it is without the extra `robot`; test_demo_grasps.py has the other half.
    module = importlib.import_module("planegrasp.cli.demo")
    monkeypatch.setattr(module, "_grasping", lambda path, seed: None)
    assert run("--output", path, "--frames", 4) == 0
    check_text(capsys.readouterr().out, path)
    check_files(path)
    check_library(ObjectLibrary(path / "objects"))
    check_recording(path)


def check_text(text, path):
    for part in ("astronaut", "carton", "cat", "of 100", "position error", "0 false detections"):
        assert part in text
    for name in ("filmstrip.png", "found", "found.jsonl", "found.rrd", "recording", "objects"):
        assert name in text
        assert (path / name).exists()
    assert "planegrasp teach" in text
    assert "Left out" in text
    assert "pip install 'planegrasp[robot]'" in text
    assert "tripod.rrd" not in text


def check_files(path):
    frames = [f"frame-{i:03d}" for i in range(4)]
    assert sorted(file.stem for file in (path / "found").iterdir()) == frames
    lines = (path / "found.jsonl").read_text("utf-8").splitlines()
    assert [json.loads(line)["frame"] for line in lines] == frames
    assert (path / "found.rrd").stat().st_size > 100_000
    # The picture of the README.
    assert (path / "filmstrip.png").stat().st_size < 1_000_000
    assert 700 < read_color(path / "filmstrip.png").shape[1] < 1000


def check_library(library):
    assert library.names == ("astronaut", "carton", "cat")
    assert [face.name for face in library["carton"].faces] == ["front", "right", "top"]


def check_recording(path):
    """The frames can be searched again, and the truth beside them is true."""
    frames = list(open_source(path / "recording"))
    assert len(frames) == 4
    assert np.median(frames[0].depth[frames[0].depth > 0]) == pytest.approx(2.0, abs=0.1)
    truth = json_lines(path / "recording" / "truth.jsonl")
    assert [line["frame"] for line in truth] == [frame.name for frame in frames]
    compared = 0
    for line, of_frame in zip(truth, json_lines(path / "found.jsonl"), strict=True):
        for detection in of_frame["detections"]:
            exact = np.array(line["T_camera_object"][detection["name"]])
            difference = np.array(detection["T_camera_object"]) - exact
            assert np.abs(difference[:3, 3]).max() < 0.01
            compared += 1
    assert compared >= 10


def json_lines(path):
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()]


def test_a_miss_is_an_error(tmp_path, monkeypatch, capsys):
    # What is searched with knows the cat only.
    monkeypatch.setattr(Demo, "detector", lambda demo: Detector([demo.models[1]]))
    assert run("--output", tmp_path, "--frames", 2, "--only", "find", "--json") == 1
    captured = capsys.readouterr()
    assert "carton was found in 0 of 2 frames" in captured.err
    result = json.loads(captured.out)
    assert result["faults"] == [
        "astronaut was found in 0 of 2 frames (at least 90% should be)",
        "carton was found in 0 of 2 frames (at least 90% should be)",
    ]
    by_name = {entry["name"]: entry for entry in result["objects"]}
    assert by_name["carton"]["median_mm"] is None
    assert by_name["cat"]["found"] == 2
    missed = [c for c in result["comparisons"] if c["object"] == "carton"]
    assert [c["estimate"] for c in missed] == [None, None]


def comparison(mm=0.0, deg=0.0, visible=1.0, found=True):
    truth = RigidTransform.from_translation([0.0, 0.0, 0.7])
    estimate = RigidTransform.from_components(
        [1e-3 * mm, 0.0, 0.7], Rotation.from_euler("y", deg, degrees=True)
    )
    return Comparison("book", "frame", 30.0, visible, truth, estimate if found else None)


def test_errors_are_distances_and_angles():
    assert comparison(mm=2.0, deg=1.5).translation_mm == pytest.approx(2.0)
    assert comparison(mm=2.0, deg=1.5).rotation_deg == pytest.approx(1.5)
    assert math.isinf(comparison(found=False).translation_mm)


def test_a_score_counts_frames_in_which_enough_is_visible():
    barely = scoring.VISIBLE_ENOUGH - 0.01
    comparisons = [
        comparison(mm=0.1),
        comparison(mm=0.3, visible=0.5),
        comparison(mm=0.5, visible=barely),
        comparison(visible=barely, found=False),
        comparison(found=False),
    ]
    score = ObjectScore.of("book", comparisons)
    assert (score.found, score.frames) == (2, 3)
    assert score.median_mm == pytest.approx(0.3)
    assert score.worst_mm == pytest.approx(0.5)
    assert score.least_visible == pytest.approx(barely)
    assert score.faults == ("book was found in 2 of 3 frames (at least 90% should be)",)


@pytest.mark.parametrize(
    ("bad", "fault"),
    [
        ({"mm": 1.2}, "median position error of book is 1.2 mm"),
        ({"deg": 0.4}, "median rotation error of book is 0.4°"),
    ],
)
def test_a_bad_pose_is_a_fault(bad, fault):
    assert not ObjectScore.of("book", [comparison(mm=0.5, deg=0.1)]).faults
    (found,) = ObjectScore.of("book", [comparison(**bad)]).faults
    assert fault in found


def test_the_objects_move_smoothly_and_lean_far():
    shares = np.linspace(0, 1, 101)
    for name in ("astronaut", "cat", "carton"):
        path = [poses(share)[name] for share in shares]
        for a, b in pairwise(path):
            assert np.linalg.norm(a.translation - b.translation) < 0.02
            assert math.degrees(rotation_angle(a.rotation, b.rotation)) < 4.0


def test_the_scene_has_steep_tilts_a_hidden_object_and_things_that_keep_apart():
    sequence = list(shots(demo_objects(), 12, seed=0))
    tilts = [shot.tilt_deg for shot in sequence]
    assert 60 < max(tilt["astronaut"] for tilt in tilts) <= 65
    assert max(tilt["cat"] for tilt in tilts) >= 55
    visible = [min(shot.visible.values()) for shot in sequence]
    assert min(visible) < 0.65
    assert sum(share > 0.99 for share in visible) >= 4
    for shot in sequence:
        corners = {
            model.name: np.vstack(
                [
                    Rectangle(
                        face.image,
                        face.width,
                        face.height,
                        shot.truth[model.name] * face.T_object_face,
                    ).corners
                    for face in model.faces
                ]
            )
            for model in demo_objects()
        }
        low = {name: points.min(axis=0) for name, points in corners.items()}
        high = {name: points.max(axis=0) for name, points in corners.items()}
        for a, b in (("astronaut", "cat"), ("astronaut", "carton"), ("cat", "carton")):
            assert np.any((low[a] > high[b]) | (low[b] > high[a])), (shot.frame.name, a, b)


def test_one_seed_gives_one_sequence():
    def colors(seed):
        return [shot.frame.color.tobytes() for shot in shots(demo_objects(), 2, seed)]

    assert colors(0) == colors(0)
    assert colors(0) != colors(1)
