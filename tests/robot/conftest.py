"""Robots that several tests share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from small_arms import SIX_DOF_MJCF, seven_dof_urdf

from planegrasp.robot import Kinematics, Robot

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="session")
def pr2() -> Robot:
    return Robot.pr2()


@pytest.fixture
def pr2_arm(pr2: Robot) -> Kinematics:
    return Kinematics(pr2)


@pytest.fixture
def six_dof_file(tmp_path: Path) -> Path:
    path = tmp_path / "six.xml"
    path.write_text(SIX_DOF_MJCF)
    return path


@pytest.fixture
def seven_dof_file(tmp_path: Path) -> Path:
    path = tmp_path / "seven.urdf"
    path.write_text(seven_dof_urdf())
    return path


@pytest.fixture
def six_dof(six_dof_file: Path) -> Robot:
    return Robot.from_file(six_dof_file, gripper_frame="tool", finger_joints=("jaw",))


@pytest.fixture
def seven_dof(seven_dof_file: Path) -> Robot:
    return Robot.from_file(seven_dof_file, gripper_frame="tool", base_frame="base")
