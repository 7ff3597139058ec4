"""Openings in terms of finger joints."""

import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.robot import Gripper, Robot

SWINGING = Gripper(("a", "b"), closed=(0.0, 1.0), opened=(0.5, -1.0), max_opening=0.1)


def test_joints_move_in_proportion():
    assert SWINGING.joint_values(0.0) == {"a": 0.0, "b": 1.0}
    assert SWINGING.joint_values(0.025) == pytest.approx({"a": 0.125, "b": 0.5})
    assert SWINGING.joint_values(0.1) == {"a": 0.5, "b": -1.0}


def test_the_opening_is_read_back():
    assert SWINGING.opening(SWINGING.joint_values(0.073)) == pytest.approx(0.073)


@pytest.mark.parametrize("opening", [-0.01, 0.11])
def test_openings_out_of_range(opening):
    with pytest.raises(InvalidInputError, match=r"opens 0 … 0.100 m"):
        SWINGING.joint_values(opening)


def test_a_gripper_that_closes_towards_its_upper_limit(six_dof_file):
    robot = Robot.from_file(six_dof_file, gripper_frame="tool", finger_joints={"jaw": (0.06, 0.0)})
    assert robot.gripper.max_opening == pytest.approx(0.06)
    assert robot.gripper.joint_values(0.01) == pytest.approx({"jaw": 0.05})


def test_a_gripper_opens():
    with pytest.raises(InvalidInputError, match="largest opening must be > 0 m"):
        Gripper(("a",), (0.0,), (1.0,), 0.0)
