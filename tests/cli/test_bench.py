"""`planegrasp bench`: options, files, tables and mistakes; what is measured is in tests/bench."""

import io
import json

import pytest
from rich.console import Console

from planegrasp.bench import tilt
from planegrasp.bench.result import BenchResult
from planegrasp.cli import main
from planegrasp.cli.bench_tables import format_value, print_result


def run(*arguments):
    """Exit code of a command."""
    with pytest.raises(SystemExit) as exit_:
        main(["bench", *map(str, arguments)])
    return exit_.value.code


@pytest.fixture
def tiny(monkeypatch):
    """Make the quick run tiny."""
    settings = tilt.TiltSettings(frames=1, tilts_deg=(0, 45), photographs=("coffee", "rocket"))
    monkeypatch.setattr(tilt.TiltSettings, "quick", classmethod(lambda cls: settings))


def printed(result, width=80):
    console = Console(width=width, record=True, highlight=False, file=io.StringIO())
    print_result(console, result, 12.3)
    return console.export_text()


@pytest.mark.usefixtures("tiny")
def test_a_run_prints_a_table_and_writes_json_and_picture(tmp_path, capsys):
    json_file, plot = tmp_path / "new" / "tilt.json", tmp_path / "tilt.png"
    options = ("--quick", "--seed", 3, "--extractors", "sift_plain, brisk")
    assert run("tilt", *options, "--json", json_file, "--plot", plot) == 0
    content = json.loads(json_file.read_text("utf-8"))
    assert content["bench"] == "tilt"
    assert content["seed"] == 3
    assert {row["extractor"] for row in content["rows"]} == {"sift_plain", "brisk"}
    assert content["settings"]["frames"] == 1
    assert plot.read_bytes().startswith(b"\x89PNG")
    out = capsys.readouterr().out
    for text in ("recall of well-textured photographs", "sift_plain", "45°", "max_tilt_deg"):
        assert text in out
    assert str(json_file) in out


@pytest.mark.usefixtures("tiny")
def test_the_number_of_frames_can_be_chosen(tmp_path):
    json_file = tmp_path / "tilt.json"
    options = ("--quick", "--frames", 2, "--extractors", "brisk", "--json", json_file)
    assert run("tilt", *options) == 0
    assert json.loads(json_file.read_text("utf-8"))["settings"]["frames"] == 2


def test_every_benchmark_has_help(capsys):
    for name in (
        "tilt",
        "objects",
        "speed",
        "pose",
        "negatives",
        "recorded",
        "estimators",
        "grasp",
    ):
        assert run(name, "--help") == 0
        out = capsys.readouterr().out
        for option in ("--seed", "--quick", "--json"):
            assert option in out


def test_an_unknown_extractor_is_refused_before_anything_is_measured(capsys):
    assert run("tilt", "--extractors", "sift,surff") == 1
    error = capsys.readouterr().err
    assert "sift_plain" in error
    assert "'sift,surff'" in error


def test_negatives_take_another_extractor(tmp_path, capsys):
    json_file = tmp_path / "negatives.json"
    options = ("--frames", 1, "--extractor", "brisk", "--json", json_file)
    assert run("negatives", *options) == 0
    assert json.loads(json_file.read_text("utf-8"))["settings"]["extractor"] == "brisk"
    assert run("negatives", "--extractor", "surff") == 1
    error = capsys.readouterr().err
    assert "'surff'" in error
    assert "opencv-sift" in error


def test_recorded_needs_data(capsys):
    assert run("recorded") == 2
    assert "--data" in capsys.readouterr().err


def test_recorded_says_what_is_missing_in_the_folder(tmp_path, capsys):
    assert run("recorded", "--data", tmp_path) == 1
    assert "ground_truth.json" in capsys.readouterr().err


def test_a_picture_of_another_kind_is_refused_before_anything_is_measured(tmp_path, capsys):
    assert run("tilt", "--plot", tmp_path / "plot.gif") == 1
    assert "'plot.gif'" in capsys.readouterr().err


def test_a_folder_is_no_file(tmp_path, capsys):
    assert run("tilt", "--json", tmp_path) == 1
    assert "is a folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("column", "value", "text"),
    [
        ("recall", 1.0, "100"),
        ("recall", 0.9997, "99.9"),
        ("45°", 0.9333, "93.3"),
        ("75°", 0.0001, "0.1"),
        ("75°", 0.0, "0"),
        ("rotation °", 0.05678, "0.0568"),
        ("ms / frame", 210.4, "210"),
        ("ms / frame", 12345.6, "12346"),
        ("objects", 6, "6"),
        ("rotation °", float("nan"), "–"),
        ("paper max °", "", ""),
    ],
)
def test_numbers_are_short_and_a_miss_is_never_rounded_away(column, value, text):
    assert format_value(column, value) == text


def test_the_tables_of_all_tilts_fit_eighty_columns():
    extractors = ("sift", "sift_plain", "akaze", "brisk", "orb")
    rows, figures = [], {}
    for extractor in extractors:
        for kind in ("well-textured", "weak"):
            row = {"extractor": extractor, "photographs": kind, "paper max °": 48.0}
            row |= {"max ° at ≥ 95 %": 70.0, "ms / frame": 123.4}
            rows.append(row | {f"{t}°": 0.955 for t in tilt.TILTS_DEG})
        figures |= {f"{extractor}.epsilon_{t}": 0.00123 for t in tilt.TILTS_DEG}
        figures |= {f"{extractor}.recall_at_{t}": 0.955 for t in tilt.TILTS_DEG}
        figures[f"{extractor}.weak.max_tilt_deg"] = 55.0
    text = printed(BenchResult("tilt", 0, {"frames": 25}, rows, figures, ("a note",)))
    assert "…" not in text
    assert text.count("95.5") == 2 * len(extractors) * len(tilt.TILTS_DEG)
    assert text.count("1.23") == len(extractors) * len(tilt.TILTS_DEG)
    assert "weak.max_tilt_deg 55" in text
    assert "epsilon_45" in text
    assert "recall_at_45" not in text  # the table has it
    assert "a note" in text
    assert "took 12 s" in text


def test_conditions_are_not_repeated_from_row_to_row():
    rows = [
        {"distance m": 0.7, "tilt °": tilt_, "hidden": "", "method": m, "recall": 1.0}
        for tilt_ in (15, 30)
        for m in ("pnp", "fused")
    ]
    text = printed(BenchResult("pose", 0, {}, rows, {"fused.recall": 1.0}))
    assert text.count("0.700") == 2
    assert text.count("fused") == 3
