import subprocess
import sys

import pytest

import planegrasp
from planegrasp import cli
from planegrasp.errors import PoseError


def leave(*arguments):
    with pytest.raises(SystemExit) as left:
        cli.main(arguments)
    return left.value.code


def test_help_lists_the_commands(capsys):
    assert leave("--help") == 0
    out = capsys.readouterr().out
    assert all(command in out for command in ("teach", "objects", "detect", "demo", "bench"))


def test_the_version_is_shown(capsys):
    assert leave("--version") == 0
    assert capsys.readouterr().out == f"planegrasp {planegrasp.__version__}\n"


def test_wrong_usage_leaves_with_2():
    assert leave("teech") == 2
    assert leave("teach") == 2


@pytest.mark.parametrize(
    ("raised", "code", "message"),
    [
        (PoseError("no [depth] here"), 1, "error: no [depth] here\n"),
        (PermissionError(13, "Permission denied", "out.png"), 1, "out.png: Permission denied"),
        (KeyboardInterrupt(), 130, ""),
    ],
)
def test_errors_become_one_line_and_an_exit_code(monkeypatch, capsys, raised, code, message):
    def fail(**_):
        raise raised

    monkeypatch.setattr(cli, "app", fail)
    assert leave("teach") == code
    assert message in capsys.readouterr().err


def test_the_command_line_imports_nothing_heavy():
    code = (
        "import sys, planegrasp.cli; "
        "print([m for m in ('numpy', 'cv2', 'scipy', 'pydantic') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_can_be_imported():
    assert set(planegrasp.__all__) <= set(dir(planegrasp))
    for name in planegrasp.__all__:
        assert getattr(planegrasp, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'Detektor'"):
        planegrasp.Detektor  # noqa: B018
