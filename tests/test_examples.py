"""Every example runs, in an environment of its own, and finds what it is about."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def run(name, *arguments, cwd):
    done = subprocess.run(
        [sys.executable, EXAMPLES / name, *arguments],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """The folder that tutorial_data.py makes, and what it printed."""
    folder = tmp_path_factory.mktemp("tutorial")
    return folder, run("tutorial_data.py", str(folder), cwd=folder)


def corners_of(printed, image):
    line = next(line for line in printed.splitlines() if image in line)
    return line.split('"')[1].split()


def test_teach_and_detect(tmp_path):
    lines = run("teach_and_detect.py", "library", cwd=tmp_path).splitlines()
    found = [line.split()[2] for line in lines if "off by" in line]
    assert sorted(found) == ["chelsea"] * 3 + ["coffee"] * 3
    degrees = [float(line.split("off by ")[1].split("°")[0]) for line in lines if "off by" in line]
    assert max(degrees) < 2.0
    assert {p.name for p in (tmp_path / "library").iterdir() if p.is_dir()} == {"coffee", "chelsea"}


def test_detect_folder(data, tmp_path):
    from planegrasp import ObjectLibrary, ObjectModel

    folder, _ = data
    library = ObjectLibrary(tmp_path / "objects")
    library.add(ObjectModel.from_image("book", folder / "book.jpg", 0.21))
    library.add(ObjectModel.from_image("poster", folder / "poster.png", 0.4))
    library.save()
    out = run("detect_folder.py", str(folder / "recording"), "objects", cwd=tmp_path)
    lines = out.splitlines()
    truth = json.loads((folder / "truth.json").read_text())
    book = [line.split() for line in lines if " book #0 " in line]
    assert len(book) == len(truth)
    for name, *_, x, y, z, _m, _s, _mm, _u, _deg in book:
        expected = np.array(truth[name]["book"])[:3, 3]
        assert np.allclose([float(x), float(y), float(z)], expected, atol=5e-3)
    assert sum("no poster: front: " in line for line in lines) == len(truth)


def test_teach_from_frame(data):
    folder, printed = data
    corners = corners_of(printed, "recording/color/000000.png")
    out = run("teach_from_frame.py", str(folder / "recording"), *corners, cwd=folder)
    first, *rest = out.splitlines()
    width, height = (float(v) for v in first.split(" mm")[0].split(" × "))
    assert (width, height) == pytest.approx((210, 140), rel=0.02)
    assert (
        sum("inliers" in line for line in rest)
        == len(json.loads((folder / "truth.json").read_text())) - 1
    )


def test_wrong_usage_shows_how(tmp_path):
    done = subprocess.run(
        [sys.executable, EXAMPLES / "detect_folder.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "examples/detect_folder.py RECORDING LIBRARY" in done.stderr
