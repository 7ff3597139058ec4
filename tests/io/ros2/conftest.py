"""Nodes in a DDS domain of their own, on the loopback interface."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds")
pytest.importorskip("rosbags")

from ros2_driver import free_domain

from planegrasp.io.ros2.dds import DdsConfig, DdsNode


@pytest.fixture
def domain():
    return free_domain()


@pytest.fixture
def node(domain):
    with DdsNode(DdsConfig(domain)) as first:
        yield first


@pytest.fixture
def start():
    """Start a script of the tests' folder in a process of its own; it says when it is ready."""
    begun = []

    def begin(script, *arguments):
        path = Path(__file__).parents[2] / script
        process = subprocess.Popen(
            [sys.executable, str(path), *map(str, arguments)], stdout=subprocess.PIPE, text=True
        )
        begun.append(process)
        assert process.stdout.readline() == "ready\n"
        return process

    yield begin
    for process in begun:
        with process:
            process.kill()
