"""The JSON of a benchmark, which later versions are compared by."""

import json
import math

import numpy as np

from planegrasp.bench.result import BenchResult


def result():
    return BenchResult(
        bench="tilt",
        seed=7,
        settings={"frames": 2, "tilts_deg": [0, 45]},
        rows=[{"extractor": "sift", "45°": 0.5}],
        figures={
            "sift.max_tilt_deg": np.float64(45.0),
            "none": math.nan,
            "endless": math.inf,
            "count": 3,
        },
        notes=("a note",),
    )


def test_the_json_has_the_keys_that_are_kept():
    content = json.loads(result().to_json())
    assert list(content) == ["bench", "seed", "machine", "settings", "rows", "figures"]
    assert content["bench"] == "tilt"
    assert content["seed"] == 7
    assert content["settings"] == {"frames": 2, "tilts_deg": [0, 45]}
    assert content["rows"] == [{"extractor": "sift", "45°": 0.5}]


def test_the_machine_is_described():
    machine = json.loads(result().to_json())["machine"]
    assert machine["cores"] >= 1
    assert {"processor", "architecture", "python", "numpy", "opencv"} <= set(machine)


def test_figures_are_numbers_or_null():
    figures = json.loads(result().to_json())["figures"]
    assert figures == {"sift.max_tilt_deg": 45.0, "none": None, "endless": None, "count": 3.0}


def test_the_file_is_written_into_a_new_folder(tmp_path):
    path = tmp_path / "a" / "b.json"
    result().write(path)
    assert json.loads(path.read_text("utf-8")) == json.loads(result().to_json())
    assert [file.name for file in path.parent.iterdir()] == ["b.json"]
