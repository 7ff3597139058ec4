"""What works without the extra `robot`."""

import subprocess
import sys

import pytest

WITHOUT = "import sys; sys.modules['mujoco'] = None; "


def run(code):
    return subprocess.run(
        [sys.executable, "-c", WITHOUT + code], check=False, capture_output=True, text=True
    )


def test_rendering_needs_no_mujoco():
    done = run("import planegrasp.simulation, planegrasp.bench, planegrasp.simulation.objects")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("module", ["raycast_camera", "supports"])
def test_the_world_says_what_to_install(module):
    done = run(f"import planegrasp.simulation.{module}")
    assert done.returncode != 0
    assert "MissingExtraError" in done.stderr
    assert "planegrasp[robot]" in done.stderr
