"""What colcon, ros2 launch and RViz read of the package: stand-ins in the place of these."""

from __future__ import annotations

import importlib.util
import re
import runpy
import sys
import types
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field
from pathlib import Path

import pytest

pytest.importorskip("rosbags")  # brings ruamel.yaml

from ruamel.yaml import YAML

from planegrasp.io.ros2 import GraspTopics, LiveTopics

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "ros2" / "planegrasp_ros"


@dataclass
class Argument:
    name: str
    default_value: str
    description: str


@dataclass(frozen=True)
class Configuration:
    name: str


@dataclass
class Condition:
    when: Configuration


@dataclass
class Node:
    package: str
    executable: str
    name: str = ""
    output: str = ""
    parameters: list = field(default_factory=list)
    arguments: list = field(default_factory=list)
    condition: Condition | None = None


@pytest.fixture
def launched(monkeypatch):
    """What the launch file describes."""
    stand_ins = {
        "ament_index_python.packages": {"get_package_share_directory": lambda name: str(PACKAGE)},
        "launch": {"LaunchDescription": list},
        "launch.actions": {"DeclareLaunchArgument": Argument},
        "launch.conditions": {"IfCondition": Condition},
        "launch.substitutions": {"LaunchConfiguration": Configuration},
        "launch_ros": {},
        "launch_ros.actions": {"Node": Node},
        "ament_index_python": {},
    }
    for name, members in stand_ins.items():
        module = types.ModuleType(name)
        module.__dict__.update(members)
        monkeypatch.setitem(sys.modules, name, module)
    path = PACKAGE / "launch" / "planegrasp.launch.py"
    spec = importlib.util.spec_from_file_location("planegrasp_launch", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.generate_launch_description()


@pytest.fixture
def built(monkeypatch):
    """What setup.py hands to setuptools, from the package's folder as colcon runs it."""
    given = {}
    setuptools = types.ModuleType("setuptools")
    setuptools.setup = lambda **options: given.update(options)
    monkeypatch.setitem(sys.modules, "setuptools", setuptools)
    monkeypatch.chdir(PACKAGE)
    runpy.run_path("setup.py")
    return given


def test_the_launch_file_starts_the_node_and_rviz(launched, built):
    arguments = {one.name: one for one in launched if isinstance(one, Argument)}
    live, rviz = (one for one in launched if isinstance(one, Node))
    assert (live.package, live.executable) == ("planegrasp_ros", "live")
    (script,) = built["entry_points"]["console_scripts"]
    assert script.startswith(f"{live.executable} = planegrasp_ros.live_node:")
    file, overridden = live.parameters
    assert file == Configuration("params")
    assert Path(arguments["params"].default_value).is_file()
    text = Path(arguments["params"].default_value).read_text()
    (whole,) = YAML(typ="safe").load(text).values()
    assert set(overridden) <= set(whole["ros__parameters"])
    for name, configuration in overridden.items():
        assert arguments[configuration.name].default_value == whole["ros__parameters"][name]
    assert rviz.condition.when == Configuration("rviz")
    assert arguments["rviz"].default_value == "false"
    assert rviz.arguments[0] == "-d"
    assert Path(rviz.arguments[1]).is_file()


def test_all_files_are_installed(built):
    installed = {file for _, files in built["data_files"] for file in files}
    assert all((PACKAGE / file).is_file() for file in installed)
    folders = ("config", "launch", "rviz", "resource")
    there = {
        str(path.relative_to(PACKAGE))
        for folder in folders
        for path in (PACKAGE / folder).iterdir()
        if path.is_file()
    }
    assert there <= installed
    assert "package.xml" in installed


def test_the_entry_point_is_there(built):
    (script,) = built["entry_points"]["console_scripts"]
    module, _, function = script.partition(" = ")[2].partition(":")
    source = (PACKAGE / Path(*module.split(".")).with_suffix(".py")).read_text()
    assert f"def {function}(" in source


def test_it_depends_on_all_packages_of_its_messages():
    root = ET.parse(PACKAGE / "package.xml").getroot()
    assert root.get("format") == "3"
    assert root.findtext("export/build_type") == "ament_python"
    needed = {one.text for one in root.findall("exec_depend")}
    sources = (ROOT / "python" / "planegrasp" / "io" / "ros2").glob("*.py")
    used = {
        package for source in sources for package in re.findall(r'"(\w+)/msg/', source.read_text())
    }
    assert len(used) >= 8
    assert used <= needed


def test_rviz_shows_what_is_published():
    settings = YAML(typ="safe").load((PACKAGE / "rviz" / "planegrasp.rviz").read_text())
    displays = settings["Visualization Manager"]["Displays"]
    shown = {(one["Class"], one["Topic"]["Value"]) for one in displays if "Topic" in one}
    topics, grasps = LiveTopics(), GraspTopics()
    assert shown == {
        ("rviz_default_plugins/MarkerArray", topics.markers),
        ("rviz_default_plugins/Image", topics.overlay),
        ("rviz_default_plugins/Pose", grasps.pose("pregrasp")),
        ("rviz_default_plugins/Pose", grasps.pose("grasp")),
    }
    assert any(one["Class"] == "rviz_default_plugins/TF" for one in displays)
