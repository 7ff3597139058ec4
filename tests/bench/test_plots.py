"""Pictures of benchmarks: they are drawn from a result alone, and what is on them."""

import builtins
import math

import cv2
import numpy as np
import pytest

from planegrasp.bench.plots import write_plot
from planegrasp.bench.result import BenchResult
from planegrasp.errors import InvalidInputError, MissingExtraError

TILTS = (0, 45, 75)


def tilt_result():
    rows, figures = [], {}
    for extractor, recalls in {"sift": (1, 1, 0.9), "brisk": (1, 0.8, 0), "own": (1, 0, 0)}.items():
        row = {"extractor": extractor, "photographs": "well-textured"}
        rows.append(row | {f"{t}°": r for t, r in zip(TILTS, recalls, strict=True)})
        figures |= {f"{extractor}.epsilon_{t}": 1e-3 * (t + 1) for t in TILTS}
    figures["brisk.epsilon_75"] = math.nan
    return BenchResult("tilt", 0, {}, rows, figures)


def objects_result():
    rows = [{"objects": n, "over one object": 1 + 0.1 * n} for n in (1, 2, 3, 6, 10, 1000)]
    return BenchResult("objects", 0, {}, rows, {})


def pose_result():
    rows = [
        {
            "distance m": 0.7,
            "tilt °": tilt,
            "hidden": hidden,
            "method": method,
            "rotation °": math.nan if method == "three_point" else 0.1 + tilt / 100,
            "translation mm": 0.4,
        }
        for tilt in (0, 30)
        for hidden in ("", "40 %")
        for method in ("three_point", "pnp", "fused", "marker")
    ]
    return BenchResult("pose", 0, {}, rows, {})


@pytest.mark.parametrize("result", [tilt_result(), objects_result(), pose_result()])
def test_a_picture_is_written(result, tmp_path):
    path = tmp_path / "plot.png"
    write_plot(result, path)
    image = cv2.imread(str(path))
    assert image.shape[1] >= 900
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 20
    assert [file.name for file in tmp_path.iterdir()] == ["plot.png"]


def drawn(result, tmp_path):
    path = tmp_path / "plot.svg"
    write_plot(result, path)
    return path.read_text("utf-8")


def test_tilt_names_the_extractors_and_marks_the_papers_angles(tmp_path):
    text = drawn(tilt_result(), tmp_path)
    for label in ("SIFT, oblique views", "FAST + BRISK", "own", "largest angle in the paper"):
        assert label in text


def test_objects_draws_the_paper_beside_ours_and_notes_large_libraries(tmp_path):
    text = drawn(objects_result(), tmp_path)
    for label in ("planegrasp, SIFT", "paper, SURF", "1000: 101.0 ×"):
        assert label in text


def test_pose_draws_every_method_and_the_hidden_face(tmp_path):
    text = drawn(pose_result(), tmp_path)
    for label in ("AprilTag 36h11", "three_point (paper)", "fused (default), 40 % hidden"):
        assert label in text


def test_other_benchmarks_have_no_picture(tmp_path):
    result = BenchResult("negatives", 0, {}, [], {})
    with pytest.raises(InvalidInputError, match="there is one of tilt, objects, pose"):
        write_plot(result, tmp_path / "plot.png")


def test_without_matplotlib_it_says_what_to_install(tmp_path, monkeypatch):
    real = builtins.__import__

    def refuse(name, *args, **kwargs):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(MissingExtraError, match=r"planegrasp\[bench\]"):
        write_plot(tilt_result(), tmp_path / "plot.png")
