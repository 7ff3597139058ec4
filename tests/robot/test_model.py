"""Robots from files, and their frames, against transforms composed by hand."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from planegrasp.errors import InvalidInputError, RobotError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.robot import Robot, RobotState


def moved(x=0.0, y=0.0, z=0.0, axis=(0, 0, 1), angle=0.0):
    """A joint's frame: shifted, then turned about an axis."""
    turn = Rotation.from_rotvec(angle * np.array(axis, dtype=float))
    return RigidTransform.from_components((x, y, z), turn)


def assert_same_pose(a, b):
    np.testing.assert_allclose(a.as_matrix(), b.as_matrix(), atol=1e-9)


def test_the_arm_is_what_moves_the_gripper(six_dof, seven_dof):
    assert six_dof.arm_joints == ("j1", "j2", "j3", "j4", "j5", "j6")
    assert seven_dof.arm_joints == ("a1", "a2", "a3", "a4", "a5", "a6", "a7")
    assert seven_dof.continuous.tolist() == [False] * 4 + [True, False, True]


def test_mjcf_forward_kinematics_by_hand(six_dof):
    q = [0.3, -0.7, 0.9, 1.1, -0.4, 2.0]
    T = moved(0.3, -0.2, 0.5, angle=0.4) * moved(z=0.1, angle=q[0])
    T = T * moved(z=0.25, axis=(0, 1, 0), angle=q[1]) * moved(0.4, axis=(0, 1, 0), angle=q[2])
    T = T * moved(0.3, axis=(1, 0, 0), angle=q[3]) * moved(0.08, axis=(0, 1, 0), angle=q[4])
    T = T * moved(0.06, axis=(1, 0, 0), angle=q[5]) * moved(0.12, axis=(1, 0, 0), angle=0.3)
    assert_same_pose(six_dof.T_base_gripper(six_dof.with_arm(six_dof.home, q)), T)


def test_urdf_keeps_fixed_links(seven_dof):
    T = moved(0.1 + 0.2 + 0.2 + 0.15 + 0.15 + 0.1, z=0.4)
    # A URDF's rpy turn about fixed axes, roll first.
    mount = RigidTransform.from_components(
        (0.1, 0, 0), Rotation.from_euler("xyz", (0.2, 0.3, -0.4))
    )
    stretched = seven_dof.with_arm(seven_dof.home, np.zeros(7))
    assert_same_pose(seven_dof.T_base_gripper(stretched), T * mount)


def test_the_base_may_be_any_link(six_dof_file):
    robot = Robot.from_file(six_dof_file, gripper_frame="tool", base_frame="link1")
    assert robot.arm_joints == ("j2", "j3", "j4", "j5", "j6")
    stretched = robot.T_base_gripper(robot.with_arm(robot.home, np.zeros(5)))
    np.testing.assert_allclose(
        stretched.translation, (0.4 + 0.3 + 0.08 + 0.06 + 0.12, 0, 0.25), atol=1e-9
    )


def test_velocity_limits_from_argument_file_and_default(six_dof_file, seven_dof_file):
    six = Robot.from_file(six_dof_file, gripper_frame="tool", velocity_limits={"j1": 0.7})
    assert six.velocity_limits.tolist() == [0.7, 1.5, 1.0, 1.0, 1.0, 1.0]
    seven = Robot.from_file(seven_dof_file, gripper_frame="tool")
    assert seven.velocity_limits.tolist() == [2.0, 2.0, 2.5, 2.5, 3.0, 3.0, 3.0]


def test_soft_limits_lie_inside(six_dof_file, seven_dof):
    six = Robot.from_file(six_dof_file, gripper_frame="tool", limit_margin=0.2)
    np.testing.assert_allclose(six.soft_lower, six.lower + 0.2)
    np.testing.assert_allclose(six.soft_upper, six.upper - 0.2)
    assert np.isinf(seven_dof.soft_upper[seven_dof.continuous]).all()


def test_a_margin_leaves_most_of_a_short_range(six_dof_file):
    robot = Robot.from_file(six_dof_file, gripper_frame="jaw", limit_margin=2.0)
    ranges = robot.upper - robot.lower
    np.testing.assert_allclose(robot.soft_upper - robot.soft_lower, 0.8 * ranges)


def test_state_by_parts(six_dof):
    q = np.linspace(-0.5, 0.5, 6)
    state = six_dof.with_opening(six_dof.with_arm(six_dof.home, q), 0.03)
    np.testing.assert_allclose(six_dof.arm(state), q)
    assert six_dof.opening(state) == pytest.approx(0.03)
    assert six_dof.joint(state, "jaw") == pytest.approx(0.03)
    assert six_dof.joint(six_dof.with_joints(state, {"j1": 1.0}), "j1") == 1.0
    assert six_dof.joint(state, "j1") == q[0]
    with pytest.raises(ValueError, match="read-only"):
        state.qpos[0] = 1.0


def test_home_by_name_position_or_middle(six_dof_file, tmp_path):
    by_position = Robot.from_file(six_dof_file, gripper_frame="tool", home={"j3": 0.4})
    assert by_position.joint(by_position.home, "j3") == 0.4
    text = six_dof_file.read_text().replace('range="-2 2"', 'range="0.5 1.5"')
    text = text.replace(
        "<custom>", '<keyframe><key name="up" qpos="1 1 0 0 1 0 0"/></keyframe><custom>'
    )
    other = tmp_path / "other.xml"
    other.write_text(text)
    by_key = Robot.from_file(other, gripper_frame="tool", home="up")
    assert by_key.arm(by_key.home).tolist() == [1, 1, 0, 0, 1, 0]
    other.write_text(six_dof_file.read_text().replace('range="-2 2"', 'range="0.5 1.5"'))
    middle = Robot.from_file(other, gripper_frame="tool")
    assert middle.arm(middle.home).tolist() == [0, 1, 0, 0, 1, 0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"gripper_frame": "hand"}, "no gripper frame 'hand'; it has site: tool; body: .*link6"),
        ({"gripper_frame": "tool", "base_frame": "foot"}, "no base frame 'foot'"),
        ({"gripper_frame": "tool", "arm_joints": ("j1", "q2")}, "no arm joint 'q2'; .*j6"),
        ({"gripper_frame": "tool", "exclude_joints": ("q2",)}, "no joint 'q2'"),
        ({"gripper_frame": "tool", "finger_joints": ("thumb",)}, "no finger joint 'thumb'"),
        ({"gripper_frame": "tool", "camera_frame": "eye"}, "no camera frame 'eye'"),
        ({"gripper_frame": "tool", "home": "sleep"}, "no keyframe 'sleep'"),
        ({"gripper_frame": "link1", "base_frame": "link2"}, "'link1' does not hang on 'link2'"),
        ({"gripper_frame": "stand"}, "no joint moves 'stand'"),
        ({"gripper_frame": "tool", "arm_joints": ("j2", "j1")}, "order from the base"),
        ({"gripper_frame": "tool", "arm_joints": ("j1", "jaw")}, "jaw do not move the gripper"),
        ({"gripper_frame": "tool", "finger_joints": ("j6",)}, "max_opening .* must be given"),
        ({"gripper_frame": "tool", "velocity_limits": {"j1": 0.0}}, "'j1' must be > 0"),
    ],
)
def test_names_that_are_not_there(six_dof_file, options, message):
    with pytest.raises(RobotError, match=message):
        Robot.from_file(six_dof_file, **options)


def test_files_that_are_no_robot(tmp_path):
    with pytest.raises(RobotError, match="there is no robot model"):
        Robot.from_file(tmp_path / "none.xml", gripper_frame="tool")
    broken = tmp_path / "broken.xml"
    broken.write_text("<mujoco><worldbody><body>")
    with pytest.raises(RobotError, match=r"broken\.xml is no robot model"):
        Robot.from_file(broken, gripper_frame="tool")


def test_wrong_sizes_are_refused(six_dof):
    with pytest.raises(InvalidInputError, match=r"6 joints \(j1, .*\), got shape \(7,\)"):
        six_dof.with_arm(six_dof.home, np.zeros(7))
    with pytest.raises(InvalidInputError, match="has 7 positions, got 3"):
        six_dof.arm(RobotState(np.zeros(3)))
    with pytest.raises(InvalidInputError, match="finite vector"):
        RobotState(np.array([np.nan]))
    with pytest.raises(InvalidInputError, match="limit_margin"):
        Robot.from_file(six_dof.path, gripper_frame="tool", limit_margin=-0.1)


def test_without_camera_or_gripper(six_dof, seven_dof):
    with pytest.raises(RobotError, match="no camera"):
        six_dof.T_base_camera(six_dof.home)
    with pytest.raises(RobotError, match="no joints that turn a camera"):
        six_dof.look_at((1, 0, 0))
    with pytest.raises(RobotError, match="no gripper"):
        seven_dof.with_opening(seven_dof.home, 0.01)


def test_threads_share_a_robot(pr2):
    rng = np.random.default_rng(0)
    states = [pr2.with_arm(pr2.home, rng.uniform(-1, 1, 7)) for _ in range(200)]
    alone = [pr2.T_base_gripper(state).as_matrix() for state in states]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(pr2.T_base_gripper, states))
    np.testing.assert_array_equal([T.as_matrix() for T in together], alone)


def test_without_the_extra_the_error_says_what_to_install():
    program = (
        "import sys; sys.modules['mujoco'] = None\n"
        "import planegrasp\n"
        "try: import planegrasp.robot\n"
        "except planegrasp.PlanegraspError as error: print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert "pip install 'planegrasp[robot]'" in done.stdout
