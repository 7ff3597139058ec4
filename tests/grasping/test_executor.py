"""Plans carried out by an ideal arm: what is done, in which order, how fast, and the way back."""

from dataclasses import replace

import numpy as np
import pytest
from ideal_arm import constant_velocity
from plans import within_reach
from runs import CONFIG, Run
from small_arms import seven_dof_urdf

from planegrasp.errors import InvalidInputError, RobotError
from planegrasp.geometry import RigidTransform, rotation_angle
from planegrasp.grasping.executor import ExecutorConfig, GraspExecutor
from planegrasp.grasping.planner import GraspPlanner, PlannerConfig
from planegrasp.robot import Robot
from planegrasp.robot.path import Path
from planegrasp.robot.scene import Obstacle, Scene


def test_an_object_that_stands_still_is_held(pr2, side_plan, body):
    run = Run(pr2, side_plan)
    execution = run(body)
    assert execution.is_held
    assert (execution.outcome, execution.reason) == ("held", "")
    assert execution.seconds == pytest.approx(run.arm.time)
    assert run.stages == ["moved", "reached", "closed", "lifted"]
    assert run.arm.grips == [(side_plan.opening, side_plan.force), (0.0, side_plan.force)]
    raised = RigidTransform.from_translation([0.0, 0.0, 0.12]) * side_plan.T_base_gripper
    expected = {
        "moved": side_plan.T_base_pregrasp,
        "reached": side_plan.T_base_gripper,
        "closed": side_plan.T_base_gripper,
        "lifted": raised,
    }
    for stage, T in expected.items():
        reached = run.at[stage][2]
        assert np.linalg.norm(reached.translation - T.translation) < 1e-4
        assert rotation_angle(reached.rotation, T.rotation) < 2e-4
    run.check_speeds()
    # The fingers have pressed for the time that was asked for.
    assert run.at["closed"][1] - run.at["reached"][1] == pytest.approx(CONFIG.settle, abs=0.021)


@pytest.mark.parametrize("moving", [False, True])
def test_any_robot_grasps(other_robot, card, moving):
    planner = GraspPlanner(other_robot, PlannerConfig(lift=0.05))
    plan = planner.plan_at(card, within_reach(other_robot, card))
    velocity = np.array([0.0, 0.005, 0.0]) * moving
    run = Run(other_robot, plan, constant_velocity(plan.T_base_object, velocity))
    execution = run(card.outer_body, blind_from=np.inf if moving else None)
    assert execution.is_held, execution
    run.check_speeds()
    _, time, T_base_gripper = run.at["closed"]
    wanted = plan.grasp.adapt(run.motion(time))
    assert np.linalg.norm(T_base_gripper.translation - wanted.translation) < 0.002


def test_it_is_lifted_as_fast_as_asked_for(pr2, side_plan, body):
    config = replace(CONFIG, lift_speed=0.1)
    run = Run(pr2, side_plan)
    run(body, config=config)
    rising = run.points(run.at["closed"][0] - 1)
    speeds = np.linalg.norm(np.diff(rising, axis=0), axis=1) / config.period
    # Sampled at other times than where the speed was measured.
    assert 0.095 < speeds.max() < 0.105


def test_accelerations_are_limited(pr2, side_plan, body):
    run = Run(pr2, side_plan)
    run(body)
    speeds = np.diff(run.arm.commands, axis=0) / CONFIG.period
    accelerations = np.diff(speeds, axis=0) / CONFIG.period
    # The path is limited at its points; between them the spline may exceed it a little.
    assert np.abs(accelerations).max() < 1.3 * CONFIG.acceleration


def test_a_clock_that_leaps_does_not_make_the_arm_leap(pr2, side_plan, body):
    run = Run(pr2, side_plan, leap=0.05)
    assert run(body).is_held
    run.check_speeds()


def test_a_plan_may_begin_at_its_pregrasp(pr2, side_plan, body):
    plan = replace(side_plan, move=Path(side_plan.move.q[-1:]))
    start = pr2.with_arm(pr2.home, plan.move.start)
    run = Run(pr2, plan, start=start)
    assert run(body).is_held
    missed = Run(pr2, plan, start=start, slippery_from=0.0)
    assert missed(body).outcome == "missed"
    missed.check_retreat()


def test_fingers_that_flicker_press(pr2, side_plan, body):
    steady = Run(pr2, side_plan)
    steady(body)
    run = Run(pr2, side_plan, flicker=0.1)
    assert run(body).is_held
    # As soon as those that press all the time.
    took = [r.at["closed"][1] - r.at["reached"][1] for r in (run, steady)]
    assert took[0] == pytest.approx(took[1], abs=0.021)


def test_fingers_that_close_on_nothing_have_missed(pr2, side_plan, body):
    run = Run(pr2, side_plan, slippery_from=0.0)
    execution = run(body)
    assert execution.outcome == "missed"
    assert execution.reason == "the fingers found nothing to press on in 2 s"
    assert run.stages == ["moved", "reached", "retreated"]
    run.check_retreat()
    # Straight back first, as it came.
    turn = run.turning_point()
    leaving = side_plan.T_base_gripper.inv().apply(run.points(turn))
    near = leaving[leaving[:, 0] > -0.095]
    assert len(near) > 10
    assert np.abs(near[:, 1:]).max() < 0.001


def test_an_object_that_is_pulled_away_has_been_missed(pr2, side_plan, body):
    still = Run(pr2, side_plan)
    still(body, blind_from=np.inf)
    pulled = still.at["reached"][1] - 0.1
    motion = constant_velocity(side_plan.T_base_object, (0.0, 0.25, 0.0), since=pulled)
    run = Run(pr2, side_plan, motion, slippery_from=0.0)
    execution = run(body, blind_from=np.inf)
    assert execution.outcome == "missed"
    run.check_retreat()


@pytest.mark.parametrize("moving", [False, True])
def test_what_falls_while_it_is_lifted_was_dropped(pr2, side_plan, body, moving):
    still = Run(pr2, side_plan)
    eyes = {"blind_from": np.inf} if moving else {}
    still(body, **eyes)
    run = Run(pr2, side_plan, slippery_from=still.at["closed"][1] + 0.5)
    execution = run(body, **eyes)
    assert execution.outcome == "dropped"
    assert run.stages == ["moved", "reached", "closed", "retreated"]
    run.check_retreat()


def test_an_obstacle_above_a_moving_object_stops_the_lift(pr2, side_plan, body):
    above = side_plan.T_base_object.apply([0.0, 0.105, 0.0]) + np.array([0.0, 0.0, 0.08])
    lid = Obstacle("lid", (0.02, 0.02, 0.02), RigidTransform.from_translation(above))
    run = Run(pr2, side_plan)
    execution = run(body, blind_from=np.inf, scene=Scene((lid,)))
    assert execution.outcome == "blocked"
    assert execution.reason.startswith("while it was lifted, ")
    assert "lid" in execution.reason
    # Opened in mid-air the gripper would let it fall: the arm stays where it is, closed.
    assert execution.reason.endswith("the arm stays and holds the object")
    assert run.stages == ["moved", "reached", "closed"]
    assert run.arm.is_gripping


def test_an_arm_that_does_not_follow_is_blocked(pr2, side_plan, body):
    run = Run(pr2, side_plan, stuck_from=2.0)
    execution = run(body)
    assert execution.outcome == "blocked"
    assert "the arm does not follow: r_" in execution.reason
    # It cannot go back either, and is told to stay where it is.
    assert "; then, on the way back, the arm does not follow: r_" in execution.reason
    assert "retreated" not in run.stages
    np.testing.assert_array_equal(run.arm.commands[-1], pr2.arm(run.arm.state))
    # At no time was it told to be much farther than that.
    off = np.abs(np.array(run.arm.commands) - pr2.arm(run.arm.state)).max(axis=1)
    first = np.argmax(off[20:] < 0.01) + 20
    assert off[first:].max() < CONFIG.following + 0.05


def test_an_arm_that_is_somewhere_else_does_not_move(pr2, side_plan, body):
    elsewhere = pr2.with_arm(pr2.home, pr2.arm(pr2.home) + 0.1 * np.eye(7)[3])
    run = Run(pr2, side_plan, start=elsewhere)
    with pytest.raises(InvalidInputError, match=r"r_elbow_flex is 0\.10 away from there"):
        run(body)
    assert len(run.arm.commands) == 1
    assert run.arm.grips == []
    # A whole turn of a joint without limits is the same place.
    turned = pr2.with_arm(pr2.home, pr2.arm(pr2.home) + 2 * np.pi * pr2.continuous)
    assert pr2.continuous.any()
    run = Run(pr2, side_plan, start=turned)
    run.arm.commands.clear()
    run.arm.given.clear()
    assert run(body).is_held
    run.check_speeds()


def test_a_torso_that_is_somewhere_else_is_noticed(pr2, side_plan, body):
    """The arm's joints are where the plan begins, but the shoulder is 0.1 m too low."""
    lower = pr2.with_joints(pr2.home, {"torso_lift": pr2.joint(pr2.home, "torso_lift") - 0.1})
    run = Run(pr2, side_plan, start=lower)
    with pytest.raises(InvalidInputError, match=r"leads 100 mm beside its grasp"):
        run(body)
    assert len(run.arm.commands) == 1
    assert run.arm.grips == []


def test_a_clock_that_stands_still_is_an_error(pr2, side_plan, body):
    run = Run(pr2, side_plan, leap=-CONFIG.period)
    with pytest.raises(RobotError, match=r"clock stands still at 0 s"):
        run(body)


def test_eyes_need_the_sighting_that_was_planned_from(pr2, side_plan, body):
    run = Run(pr2, side_plan)
    with pytest.raises(InvalidInputError, match="needs the sighting"):
        run(body, blind_from=np.inf, sighting=None)
    assert len(run.arm.commands) == 1


def test_a_robot_without_gripper_cannot_grasp(tmp_path):
    path = tmp_path / "seven.urdf"
    path.write_text(seven_dof_urdf())
    robot = Robot.from_file(path, gripper_frame="tool", base_frame="base")
    with pytest.raises(InvalidInputError, match="a robot without gripper cannot grasp"):
        GraspExecutor(robot)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"period": 0.0}, "period must be > 0"),
        ({"lead": -0.1}, "lead must be ≥ 0 and finite"),
        ({"patience": np.inf}, "patience must be ≥ 0 and finite"),
        ({"speed": 1.5}, "speed is a share of the limits"),
    ],
)
def test_a_config_out_of_range_is_refused(arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        ExecutorConfig(**arguments)
