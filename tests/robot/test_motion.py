"""Paths, checked by a checker of their own, and straight lines by forward kinematics."""

import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.robot import (
    CollisionChecker,
    CollisionConfig,
    Kinematics,
    MotionConfig,
    MotionFailure,
    Obstacle,
    Path,
    Scene,
    plan_path,
    straight_line,
)

AT = RigidTransform.from_translation
TABLE = Obstacle("table", (0.6, 1.0, 0.05), AT((0.8, 0, 0.65)))
# Between the arm at home, out to the right, and the table.
WALL = Obstacle("wall", (0.3, 0.02, 0.4), AT((0.6, -0.35, 0.9)))
SCENE = Scene((TABLE, WALL))


@pytest.fixture
def checker(pr2):
    return CollisionChecker(pr2, SCENE)


@pytest.fixture
def over_the_table(pr2, pr2_arm, checker):
    """Arm joints with the gripper over the table, pointing forwards."""
    result = pr2_arm.inverse(AT((0.65, -0.1, 0.85)), pr2.arm(pr2.home))
    free = [s.q for s in result.solutions if checker.check(s.q) is None]
    return free[0]


def assert_free(path, robot, scene, step):
    strict = CollisionChecker(robot, scene, config=CollisionConfig(margin=0.005))
    assert all(strict.check(q) is None for q in path.q)
    assert np.abs(np.diff(path.q, axis=0)).max() <= step + 1e-9
    assert np.all(path.q >= robot.soft_lower - 1e-9)
    assert np.all(path.q <= robot.soft_upper + 1e-9)


def test_a_path_around_a_wall(pr2, checker, over_the_table):
    start = pr2.arm(pr2.home)
    straight = start + np.linspace(0, 1, 200)[:, None] * (over_the_table - start)
    assert any(checker.check(q) is not None for q in straight)
    path = plan_path(checker, start, over_the_table)
    assert isinstance(path, Path)
    np.testing.assert_allclose(path.start, start)
    np.testing.assert_allclose(path.end, over_the_table)
    assert_free(path, pr2, SCENE, 0.02)


def test_corners_are_rounded(pr2, checker, over_the_table):
    start = pr2.arm(pr2.home)
    round_path, sharp = (
        plan_path(checker, start, over_the_table, config=MotionConfig(rounding=passes))
        for passes in (60, 0)
    )

    def sharpest(path):
        return np.abs(np.diff(path.q, 2, axis=0)).max()

    assert sharpest(round_path) < sharpest(sharp) / 2
    assert round_path.length < sharp.length


def test_the_same_seed_gives_the_same_path(pr2, checker, over_the_table):
    start = pr2.arm(pr2.home)
    first, other, again = (
        plan_path(checker, start, over_the_table, seed=seed) for seed in (7, 8, 7)
    )
    assert first.q.tolist() == again.q.tolist()
    assert first.q.shape != other.q.shape or not np.allclose(first.q, other.q)


def test_more_attempts_find_no_longer_path(pr2, checker, over_the_table):
    start = pr2.arm(pr2.home)
    lengths = [
        plan_path(
            checker, start, over_the_table, config=MotionConfig(attempts=attempts, rounding=0)
        ).length
        for attempts in (1, 4)
    ]
    assert lengths[1] <= lengths[0]


def test_the_way_is_straight_where_nothing_is_in_it(pr2):
    start = pr2.arm(pr2.home)
    goal = start + np.array([0.1, -0.2, 0.1, 0.2, 0.3, -0.1, 0.5])
    path = plan_path(CollisionChecker(pr2), start, goal)
    assert path.length == pytest.approx(np.linalg.norm(goal - start))


def test_continuous_joints_take_the_short_way(pr2):
    start = pr2.arm(pr2.home)
    start[6] = 3.0
    goal = start.copy()
    goal[6] = -3.0
    path = plan_path(CollisionChecker(pr2), start, goal)
    assert path.length == pytest.approx(2 * np.pi - 6.0)
    assert path.end[6] == pytest.approx(2 * np.pi - 3.0)


def test_start_and_goal_must_be_free(pr2, checker, over_the_table):
    block = Obstacle("block", (0.1, 0.1, 0.1), pr2.T_base_gripper(pr2.home))
    blocked = CollisionChecker(pr2, Scene((*SCENE.obstacles, block)))
    start = pr2.arm(pr2.home)
    at_start = plan_path(blocked, start, over_the_table)
    at_goal = plan_path(blocked, over_the_table, start)
    assert not at_start
    assert at_start.reason.startswith("at the start, r_")
    assert at_start.reason.endswith("deep in block")
    assert at_goal.reason.startswith("at the goal, r_")


def test_a_goal_outside_of_the_soft_limits_is_named(pr2, checker, over_the_table):
    beyond = over_the_table.copy()
    beyond[3] = -0.02
    outside = plan_path(checker, pr2.arm(pr2.home), beyond)
    assert not outside
    assert "r_elbow_flex is 0.080 outside of its limits" in outside.reason


def test_it_gives_up_when_time_is_up(pr2, checker, over_the_table):
    config = MotionConfig(time_limit=1e-6)
    result = plan_path(checker, pr2.arm(pr2.home), over_the_table, config=config)
    assert isinstance(result, MotionFailure)
    assert result.reason == "no path found within 1e-06 s and 3000 postures each"


def test_it_gives_up_after_a_number_of_postures(pr2, checker, over_the_table):
    start, few = pr2.arm(pr2.home), MotionConfig(most_checks=3)
    result = plan_path(checker, start, over_the_table, config=few)
    assert isinstance(result, MotionFailure)
    assert result.reason == "no path found within 3 s and 3 postures each"
    assert plan_path(checker, start, over_the_table)


def test_a_straight_line_is_straight_and_turns_evenly(pr2, pr2_arm, over_the_table):
    T_from = pr2_arm.forward(over_the_table)
    turn = Rotation.from_euler("x", 0.5)
    T_to = RigidTransform.from_components(
        T_from.translation + np.array([0.03, 0.02, 0.08]), T_from.rotation * turn
    )
    checker = CollisionChecker(pr2, Scene((TABLE,)))
    path = straight_line(pr2_arm, checker, over_the_table, T_to)
    assert isinstance(path, Path)
    assert_free(path, pr2, Scene((TABLE,)), 0.02)
    way = T_to.translation - T_from.translation
    shares = []
    for q in path.q:
        T = pr2_arm.forward(q)
        done = T.translation - T_from.translation
        share = done @ way / (way @ way)
        assert np.linalg.norm(done - share * way) < 1e-3
        expected = T_from.rotation * Rotation.from_rotvec(share * turn.as_rotvec())
        assert (T.rotation.inv() * expected).magnitude() < 1e-2
        shares.append(share)
    assert np.all(np.diff(shares) > 0)
    off = pr2_arm.forward(path.end).inv() * T_to
    assert np.linalg.norm(off.translation) < 1e-4
    assert off.rotation.magnitude() < np.radians(0.01)


def test_a_line_into_the_table_says_what_and_how_far(pr2, pr2_arm, over_the_table):
    checker = CollisionChecker(pr2, Scene((TABLE,)))
    T_from = pr2_arm.forward(over_the_table)
    result = straight_line(pr2_arm, checker, over_the_table, AT((0, 0, -0.25)) * T_from)
    assert isinstance(result, MotionFailure)
    assert "% along the line, r_" in result.reason
    assert result.reason.endswith("table")
    assert 0.1 < result.fraction < 0.9
    reached = pr2_arm.forward(result.path.end).translation
    done = T_from.translation[2] - reached[2]
    assert done == pytest.approx(0.25 * result.fraction, abs=1e-3)
    assert all(checker.check(q) is None for q in result.path.q)


def test_a_line_out_of_reach_says_so(pr2, pr2_arm, over_the_table):
    T_from = pr2_arm.forward(over_the_table)
    result = straight_line(pr2_arm, CollisionChecker(pr2), over_the_table, AT((0.6, 0, 0)) * T_from)
    assert not result
    assert "unreachable" in result.reason or "would have to jump" in result.reason
    reached = pr2_arm.forward(result.path.end).translation
    # The shoulder is at x = -0.05, the arm 1.001 m long; the line leads to 1.25.
    assert reached[0] < 0.951


def test_lines_do_not_jump_between_branches(pr2, pr2_arm, over_the_table):
    """A jump limit below what the line needs refuses it instead of passing it."""
    T_to = AT((0.0, 0.0, 0.05)) * pr2_arm.forward(over_the_table)
    config = MotionConfig(largest_jump=1e-4)
    result = straight_line(pr2_arm, CollisionChecker(pr2), over_the_table, T_to, config=config)
    assert not result
    assert "would have to jump" in result.reason


def test_steps_of_lines_and_paths(pr2, pr2_arm, over_the_table):
    checker = CollisionChecker(pr2)
    T = pr2_arm.forward(over_the_table)
    shifted = AT((0, 0, 0.05)) * T
    turned = T * RigidTransform.from_rotation(Rotation.from_euler("x", 0.2))

    def points(target, **options):
        config = MotionConfig(step=1.0, **options)
        return len(straight_line(pr2_arm, checker, over_the_table, target, config=config).q)

    assert points(shifted, line_step=0.005) == 11
    assert points(shifted, line_step=0.0125) == 5
    assert points(turned, turn_step=0.02) == 11
    assert points(turned, turn_step=0.05) == 5
    goal = over_the_table + np.array([0, 0, 0, 0, 0, 0, 0.5])
    for step in (0.02, 0.05):
        path = plan_path(checker, over_the_table, goal, config=MotionConfig(step=step))
        assert len(path.q) == round(0.5 / step) + 1


def test_paths_join_and_turn_back():
    there = Path(np.array([[0.0, 0.0], [0.1, 0.2]]))
    further = Path(np.array([[0.1, 0.2], [0.3, 0.2]]))
    both = there.then(further)
    assert both.q.tolist() == [[0.0, 0.0], [0.1, 0.2], [0.3, 0.2]]
    assert both.reversed().q.tolist() == both.q[::-1].tolist()
    assert both.length == pytest.approx(np.hypot(0.1, 0.2) + 0.2)
    with pytest.raises(InvalidInputError, match="paths must join"):
        further.then(there)
    with pytest.raises(InvalidInputError, match="finite joint positions"):
        Path(np.zeros(3))


def test_bad_input(pr2, pr2_arm, checker):
    with pytest.raises(InvalidInputError, match="q_start must be 7 finite"):
        plan_path(checker, np.zeros(6), np.zeros(7))
    with pytest.raises(InvalidInputError, match="q_goal must be 7 finite"):
        plan_path(checker, pr2.arm(pr2.home), np.full(7, np.inf))
    with pytest.raises(InvalidInputError, match="q_start must be 7 finite"):
        straight_line(pr2_arm, checker, np.zeros(2), RigidTransform.identity())
    with pytest.raises(InvalidInputError, match="step must be > 0, got 0"):
        MotionConfig(step=0.0)


def test_a_negative_seed_is_refused(pr2, checker, over_the_table):
    with pytest.raises(InvalidInputError, match="seed must be ≥ 0, got -1"):
        plan_path(checker, pr2.arm(pr2.home), over_the_table, seed=-1)


def test_planning_prints_nothing(pr2, checker, over_the_table, capfd):
    plan_path(checker, pr2.arm(pr2.home), over_the_table)
    assert capfd.readouterr() == ("", "")


def test_another_robot_plans(six_dof):
    start = six_dof.arm(six_dof.home)
    goal = start + np.array([1.2, 0.3, 0.2, 0.0, 0.4, 0.0])
    arm = Kinematics(six_dof)
    middle = arm.forward((start + goal) / 2).translation
    scene = Scene((Obstacle("post", (0.05, 0.05, 0.3), AT(middle)),))
    checker = CollisionChecker(six_dof, scene)
    path = plan_path(checker, start, goal)
    assert isinstance(path, Path)
    assert_free(path, six_dof, scene, 0.02)
