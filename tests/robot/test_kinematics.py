"""Inverse kinematics against forward kinematics, the Jacobian against differences."""

import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.robot import IKConfig, Kinematics, Robot

TENTH_OF_A_MILLIMETRE = 1e-4
HUNDREDTH_OF_A_DEGREE = np.radians(0.01)


def random_q(robot, rng):
    low = np.where(robot.continuous, -np.pi, robot.soft_lower)
    high = np.where(robot.continuous, np.pi, robot.soft_upper)
    return rng.uniform(low, high)


def assert_reaches(robot, q, T, state=None):
    """Measured by the whole robot's model, not by the arm's that solved it."""
    reached = robot.T_base_gripper(robot.with_arm(robot.home if state is None else state, q))
    off = reached.inv() * T
    assert np.linalg.norm(off.translation) < TENTH_OF_A_MILLIMETRE
    assert off.rotation.magnitude() < HUNDREDTH_OF_A_DEGREE
    assert np.all(q >= robot.soft_lower - 1e-9)
    assert np.all(q <= robot.soft_upper + 1e-9)


@pytest.mark.parametrize("name", ["pr2", "six_dof", "seven_dof"])
def test_the_arm_alone_moves_like_the_whole_robot(name, request):
    robot = request.getfixturevalue(name)
    arm = Kinematics(robot)
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = random_q(robot, rng)
        whole = robot.T_base_gripper(robot.with_arm(robot.home, q))
        np.testing.assert_allclose(arm.forward(q).as_matrix(), whole.as_matrix(), atol=1e-12)


def test_a_joint_that_starts_turned_and_a_base_that_moves(tmp_path):
    """`ref`, an excluded joint in the middle and a base frame on a moving body."""
    path = tmp_path / "odd.xml"
    path.write_text("""
    <mujoco><compiler angle="radian"/><default><geom size="0.03" mass="1"/></default><worldbody>
      <body name="cart"><joint name="drive" type="slide" axis="1 0 0"/><geom/>
        <site name="base" pos="0 0 0.1" euler="0 0 1"/>
        <body pos="0 0 0.2"><joint name="a" axis="0 0 1" ref="0.5" range="-2 2"/><geom/>
          <body pos="0.3 0 0"><joint name="stiff" axis="0 1 0" range="-1 1"/><geom/>
            <body pos="0.3 0 0"><joint name="b" axis="0 1 0" pos="0.1 0 0" range="-2 2"/><geom/>
              <body name="hand" pos="0.2 0 0"><geom/></body></body></body></body></body>
    </worldbody></mujoco>""")
    robot = Robot.from_file(
        path, gripper_frame="hand", base_frame="base", exclude_joints=("stiff",)
    )
    assert robot.arm_joints == ("a", "b")
    state = robot.with_joints(robot.home, {"drive": 0.7, "stiff": -0.6})
    arm = Kinematics(robot, state)
    for q in ((0.5, 0.0), (-1.0, 0.8), (1.2, -1.1)):
        whole = robot.T_base_gripper(robot.with_arm(state, q))
        np.testing.assert_allclose(arm.forward(q).as_matrix(), whole.as_matrix(), atol=1e-12)


@pytest.mark.parametrize("name", ["pr2", "six_dof", "seven_dof"])
def test_jacobian_is_the_central_difference(name, request):
    robot = request.getfixturevalue(name)
    arm = Kinematics(robot)
    rng = np.random.default_rng(1)
    step = 1e-5
    for _ in range(5):
        q = random_q(robot, rng)
        J = arm.jacobian(q)
        for i in range(robot.n):
            change = np.zeros(robot.n)
            change[i] = step
            ahead, behind = arm.forward(q + change), arm.forward(q - change)
            velocity = (ahead.translation - behind.translation) / (2 * step)
            turning = (ahead.rotation * behind.rotation.inv()).as_rotvec() / (2 * step)
            np.testing.assert_allclose(J[:3, i], velocity, atol=1e-8)
            np.testing.assert_allclose(J[3:, i], turning, atol=1e-8)


def test_manipulability_is_yoshikawas(pr2, pr2_arm):
    q = pr2.arm(pr2.home)
    J = pr2_arm.jacobian(q)
    assert pr2_arm.manipulability(q) == pytest.approx(np.sqrt(np.linalg.det(J @ J.T)))
    # Stretched, the elbow cannot move the gripper outwards.
    stretched = np.zeros(7)
    assert pr2_arm.manipulability(stretched) < 1e-3 * pr2_arm.manipulability(q)


def test_limit_margin(pr2, pr2_arm):
    bounded = ~pr2.continuous
    middle = np.full(7, 9.0)
    middle[bounded] = (pr2.soft_lower[bounded] + pr2.soft_upper[bounded]) / 2
    assert pr2_arm.limit_margin(middle) == pytest.approx(1.0)
    at_limit, beyond = middle.copy(), middle.copy()
    at_limit[3] = pr2.soft_upper[3]
    beyond[3] = pr2.upper[3]
    assert pr2_arm.limit_margin(at_limit) == pytest.approx(0.0)
    assert pr2_arm.limit_margin(beyond) < 0


def test_reachable_poses_are_reached(pr2, pr2_arm):
    rng = np.random.default_rng(2)
    reached = 0
    for seed in range(200):
        T = pr2_arm.forward(random_q(pr2, rng))
        result = pr2_arm.inverse(T, seed=seed)
        reached += bool(result)
        for solution in result.solutions:
            assert_reaches(pr2, solution.q, T)
    assert reached >= 198


@pytest.mark.parametrize("name", ["six_dof", "seven_dof"])
def test_other_robots_reach_too(name, request):
    robot = request.getfixturevalue(name)
    arm = Kinematics(robot)
    rng = np.random.default_rng(3)
    targets = [arm.forward(random_q(robot, rng)) for _ in range(40)]
    results = [arm.inverse(T, seed=seed) for seed, T in enumerate(targets)]
    assert sum(map(bool, results)) >= 39
    for T, result in zip(targets, results, strict=True):
        for solution in result.solutions:
            assert_reaches(robot, solution.q, T)


def test_it_is_solved_for_the_torso_as_it_stands(pr2):
    lowered = pr2.with_joints(pr2.home, {"torso_lift": 0.0})
    arm = Kinematics(pr2, lowered)
    T = RigidTransform.from_translation((0, 0, -0.2)) * pr2.T_base_gripper(pr2.home)
    result = arm.inverse(T)
    assert_reaches(pr2, result.q, T, lowered)
    np.testing.assert_allclose(result.q, pr2.arm(pr2.home), atol=1e-3)


def test_solutions_differ_and_the_nearest_comes_first(pr2, pr2_arm):
    start = np.array([-0.5, 0.3, -0.8, -1.2, 7.0, -0.9, -6.0])
    T = pr2_arm.forward(start) * RigidTransform.from_translation((0.03, 0.0, 0.02))
    result = pr2_arm.inverse(T, start)
    assert len(result.solutions) >= 2
    distances = [solution.distance for solution in result.solutions]
    assert distances == sorted(distances)
    assert distances[0] < 0.3
    for i, a in enumerate(result.solutions):
        assert np.abs(a.q - start)[pr2.continuous].max() <= np.pi + 1e-9
        assert a.limit_margin == pytest.approx(pr2_arm.limit_margin(a.q))
        for b in result.solutions[:i]:
            turns = np.exp(1j * a.q) - np.exp(1j * b.q)
            assert np.abs(turns).max() > 0.02


def test_the_same_seed_gives_the_same_solutions(pr2, pr2_arm):
    T = RigidTransform.from_translation((0.2, 0.1, -0.1)) * pr2.T_base_gripper(pr2.home)
    first, second = (pr2_arm.inverse(T, seed=5) for _ in range(2))
    assert len(first.solutions) == len(second.solutions) > 1
    for a, b in zip(first.solutions, second.solutions, strict=True):
        assert a.q.tolist() == b.q.tolist()


def test_one_solution_when_one_is_asked_for(pr2):
    arm = Kinematics(pr2, config=IKConfig(solutions=1))
    assert len(arm.inverse(pr2.T_base_gripper(pr2.home)).solutions) == 1


def test_more_starts_reach_more(six_dof):
    eager, patient = (Kinematics(six_dof, config=IKConfig(hopeless_starts=n)) for n in (1, 20))
    rng = np.random.default_rng(6)
    targets = [patient.forward(random_q(six_dof, rng)) for _ in range(30)]
    assert sum(map(bool, map(eager.inverse, targets))) < 25
    assert sum(map(bool, map(patient.inverse, targets))) >= 29


def test_further_starts_stop_with_what_was_found(pr2):
    T = pr2.T_base_gripper(pr2.home)
    once = Kinematics(pr2, config=IKConfig(starts=1)).inverse(T)
    assert len(once.solutions) == 1
    assert len(Kinematics(pr2).inverse(T).solutions) > 1


@pytest.mark.parametrize("tolerance", [1e-7, 1e-2])
def test_as_exact_as_asked_for(pr2, tolerance):
    config = IKConfig(position_tolerance=tolerance, rotation_tolerance=tolerance)
    arm = Kinematics(pr2, config=config)
    rng = np.random.default_rng(7)
    errors = []
    for _ in range(20):
        for solution in arm.inverse(arm.forward(random_q(pr2, rng))).solutions:
            assert solution.position_error <= tolerance
            assert solution.rotation_error <= tolerance
            errors.append(max(solution.position_error, solution.rotation_error))
    # No more exact than asked for either, or the tolerance would cost time for nothing.
    assert max(errors) > tolerance / 100


def test_far_away_is_refused_with_the_distance(pr2, pr2_arm):
    # The shoulder pan's axis is at (-0.05, -0.188, 0.94), the stretched arm 1.001 m long.
    T = RigidTransform.from_translation((-0.05 + 1.001 + 0.14, -0.188, 0.739675 + 0.2))
    result = pr2_arm.inverse(T)
    assert not result
    assert result.solutions == ()
    assert result.reason == "unreachable: at least 0.14 m outside the workspace"


def test_within_the_arms_length_but_behind_the_back_is_refused(pr2_arm):
    result = pr2_arm.inverse(RigidTransform.from_translation((-0.75, 0.3, 0.9)))
    assert not result
    assert result.position_error > 0.01
    assert result.reason.startswith("unreachable: 0.")
    assert result.reason.endswith("m outside the workspace")


def test_a_wrong_orientation_is_told_from_a_wrong_place(pr2, pr2_arm):
    """Stretched forwards, with the gripper pointing back at the robot."""
    place = RigidTransform.from_translation((0.75, -0.188, 0.94))
    assert pr2_arm.inverse(place)
    back = place * RigidTransform.from_rotation(Rotation.from_euler("z", np.pi))
    result = pr2_arm.inverse(back)
    assert not result
    assert result.reason.startswith("unreachable in this orientation: ")
    assert "at its limit" in result.reason or "at their limits" in result.reason
    closest = pr2_arm.forward(result.q)
    assert np.linalg.norm(closest.translation - back.translation) == pytest.approx(
        result.position_error
    )
    np.testing.assert_array_less(pr2.soft_lower - 1e-9, result.q)


def test_inverse_near_stays_on_its_branch(pr2, pr2_arm):
    q = pr2.arm(pr2.home)
    for _ in range(20):
        T = RigidTransform.from_translation((0.003, 0.0, 0.004)) * pr2_arm.forward(q)
        result = pr2_arm.inverse_near(T, q)
        assert_reaches(pr2, result.q, T)
        assert np.abs(result.q - q).max() < 0.05
        q = result.q


def test_servoing_follows_a_moving_target(pr2, pr2_arm):
    """0.1 m/s up and 0.2 rad/s about z for a second at 100 Hz: never a millimetre behind."""
    q = pr2.arm(pr2.home)
    T_start = pr2_arm.forward(q)
    dt = 0.01
    for k in range(1, 101):
        t = k * dt
        T = RigidTransform.from_components(
            T_start.translation + np.array([0, 0, 0.1 * t]),
            Rotation.from_euler("z", 0.2 * t) * T_start.rotation,
        )
        following = pr2_arm.step(q, T, dt)
        assert np.all(np.abs(following - q) <= pr2.velocity_limits * dt + 1e-9)
        q = following
        off = pr2_arm.forward(q).inv() * T
        assert np.linalg.norm(off.translation) < 1e-3
        assert off.rotation.magnitude() < 1e-3


def test_servoing_keeps_to_the_velocity_limits_it_is_given(pr2, pr2_arm):
    q = pr2.arm(pr2.home)
    far = RigidTransform.from_translation((0.3, 0, 0)) * pr2_arm.forward(q)
    limits = np.full(7, 0.1)
    moved = np.abs(pr2_arm.step(q, far, 0.02, limits) - q)
    assert moved.max() == pytest.approx(0.002, rel=1e-6)


def test_servoing_towards_the_unreachable_stays_within_limits(pr2, pr2_arm):
    q = pr2.arm(pr2.home)
    for _ in range(300):
        q = pr2_arm.step(q, RigidTransform.from_translation((2.0, 0.5, 1.2)), 0.02)
    assert np.all(q >= pr2.soft_lower - 1e-6)
    assert np.all(q <= pr2.soft_upper + 1e-6)
    assert np.isfinite(pr2_arm.forward(q).as_matrix()).all()


def test_servoing_comes_back_from_outside_of_the_soft_limits(pr2, pr2_arm):
    q = pr2.arm(pr2.home)
    q[3] = -0.02
    T = pr2_arm.forward(np.where(np.arange(7) == 3, -0.5, q))
    for _ in range(100):
        q = pr2_arm.step(q, T, 0.02)
    assert pr2_arm.limit_margin(q) > 0


def test_bad_input(pr2_arm):
    with pytest.raises(InvalidInputError, match=r"7 joints \(r_shoulder_pan, .*finite"):
        pr2_arm.forward(np.zeros(6))
    with pytest.raises(InvalidInputError, match="finite"):
        pr2_arm.jacobian(np.full(7, np.nan))
    with pytest.raises(InvalidInputError, match="dt must be > 0"):
        pr2_arm.step(np.zeros(7), RigidTransform.identity(), 0.0)
