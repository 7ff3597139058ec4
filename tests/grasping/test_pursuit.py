"""Coming to an object that moves, with an ideal arm: followed, gone round, left."""

from dataclasses import replace

import numpy as np
import pytest
from ideal_arm import constant_velocity
from runs import CONFIG, Run

from planegrasp.geometry import RigidTransform, rotation_angle
from planegrasp.robot.collision import CollisionChecker
from planegrasp.robot.scene import ObjectBody, Obstacle, Scene


@pytest.mark.parametrize("velocity", [(0.0, 0.0, 0.0), (0.0, 0.03, 0.02), (0.02, -0.03, -0.02)])
def test_a_moving_object_is_followed(pr2, side_plan, body, velocity):
    motion = constant_velocity(side_plan.T_base_object, velocity)
    run = Run(pr2, side_plan, motion)
    execution = run(body, blind_from=np.inf)
    assert execution.is_held, execution
    assert run.stages == ["moved", "reached", "closed", "lifted"]
    _, time, T_base_gripper = run.at["closed"]
    wanted = side_plan.grasp.adapt(motion(time))
    # Where it would be without following:
    moved = np.linalg.norm(wanted.translation - side_plan.T_base_gripper.translation)
    assert moved >= 2 * np.linalg.norm(velocity)
    assert np.linalg.norm(T_base_gripper.translation - wanted.translation) < 0.002
    assert rotation_angle(T_base_gripper.rotation, wanted.rotation) < np.radians(0.5)
    lifted = run.at["lifted"][2].translation - T_base_gripper.translation
    # From the highest that it was held: it went on sinking until it was sure to be let go.
    sunk = max(0.0, -velocity[2]) * CONFIG.settle
    np.testing.assert_allclose(lifted, [0.0, 0.0, 0.12 + sunk], atol=0.001)
    run.check_speeds()


def test_a_lost_object_is_left_alone(pr2, side_plan, body):
    run = Run(pr2, side_plan, constant_velocity(side_plan.T_base_object, (0.0, 0.02, 0.0)))
    # Blind just before the gripper gets to its pre-grasp.
    still = Run(pr2, side_plan)
    still(body)
    blind_from = still.at["moved"][1] - 0.2
    execution = run(body, blind_from=blind_from)
    assert execution.outcome == "lost"
    assert not execution.is_held
    assert execution.reason.startswith(("the object was not seen for 0.7", "the object's position"))
    assert run.stages == ["moved", "retreated"]
    run.check_retreat()
    # It stopped in front of the object.
    assert 0.0 not in [opening for opening, _ in run.arm.grips]


def test_the_last_part_is_done_blindly(pr2, side_plan, body):
    still = Run(pr2, side_plan)
    still(body, blind_from=np.inf)
    run = Run(pr2, side_plan)
    execution = run(body, blind_from=still.at["reached"][1] - 0.4)  # 32 mm before it
    assert execution.is_held, execution


def test_an_object_that_is_too_fast_is_left_behind(pr2, side_plan, body):
    slow = replace(CONFIG, speed=0.1)
    run = Run(pr2, side_plan, constant_velocity(side_plan.T_base_object, (0.0, 0.12, 0.0)))
    execution = run(body, blind_from=np.inf, config=slow)
    assert execution.outcome == "left behind"
    assert "not caught up with in 4 s, the gripper stayed" in execution.reason
    assert run.stages == ["moved", "retreated"]
    run.check_speeds(slow)
    np.testing.assert_allclose(run.arm.commands[-1], run.arm.commands[0], atol=1e-9)


def test_an_obstacle_in_the_way_of_a_moving_object_stops_the_arm(pr2, side_plan, body):
    # The object passes above a post that its gripper cannot pass through.
    velocity = np.array([0.0, 0.04, 0.0])
    palm = side_plan.T_base_pregrasp * RigidTransform.from_translation([-0.1, 0.0, 0.0])
    at = palm.translation + np.array([0.0, 0.25, 0.0])
    post = Obstacle("post", (0.03, 0.03, 0.6), RigidTransform.from_translation(at))
    run = Run(pr2, side_plan, constant_velocity(side_plan.T_base_object, velocity))
    config = replace(CONFIG, reach_speed=0.01, patience=20.0)
    execution = run(body, blind_from=np.inf, scene=Scene((post,)), config=config)
    assert execution.outcome == "blocked"
    assert execution.reason.startswith("on the way to the object ")
    assert "post" in execution.reason
    run.check_retreat()


def test_the_planned_motion_ends_before_an_object_that_moved_into_it(pr2, side_plan, body):
    # Towards where the gripper's way ends, while the arm is on it.
    way = side_plan.T_base_pregrasp.translation - side_plan.T_base_gripper.translation
    run = Run(pr2, side_plan, constant_velocity(side_plan.T_base_object, 0.4 * way))
    checker = CollisionChecker(pr2, Scene(object=ObjectBody(body.size, side_plan.T_base_object)))
    in_contact = []
    drive = run.arm.advance

    def advance(seconds):
        drive(seconds)
        lying = ObjectBody(body.size, run.motion(run.arm.time), None, body.centre)
        checker.set_object(lying)
        if run.arm.grips[-1][0] > 0:
            q = run.arm.commands[-1]
            fingers = checker.fingers_on_object
            in_contact.append(checker.check(q, side_plan.opening, allowed=fingers))

    run.arm.advance = advance
    run(body, blind_from=np.inf)
    assert run.stages[0] == "moved"
    # It was to be at its pre-grasp, 100 mm before where the object was.
    short = run.at["moved"][2].translation - side_plan.T_base_pregrasp.translation
    assert np.linalg.norm(short) > 0.01
    # Whatever the margin of 5 mm: nothing is ever inside of the object.
    assert all(contact is None or contact.depth < 0 for contact in in_contact)


@pytest.mark.parametrize("share", [0.4, 0.8])
def test_an_object_that_moved_into_the_way_is_gone_round(pr2, side_plan, body, share):
    # Against the arm for a second and a half, at up to 0.08 m/s.
    way = share * (side_plan.T_base_pregrasp.translation - side_plan.T_base_gripper.translation)

    def motion(time):
        return RigidTransform.from_translation(way * min(time, 1.5)) * side_plan.T_base_object

    run = Run(pr2, side_plan, motion)
    execution = run(body, blind_from=np.inf, config=replace(CONFIG, patience=12.0))
    assert execution.is_held, execution
    assert run.stages == ["moved", "reached", "closed", "lifted"]
    run.check_speeds()
    # It stood still while another way was looked for.
    before = np.array(run.times()) < run.at["moved"][1]
    pauses = np.diff(np.array(run.times())[before])
    assert pauses.max() == pytest.approx(CONFIG.thinking + CONFIG.period)


def test_what_moves_along_is_kept_away_from(pr2, side_plan, body):
    """A forearm that comes along with the object is not touched, and ends the motion if it must."""
    at = side_plan.T_base_object * RigidTransform.from_translation([0.0, -0.25, 0.0])
    forearm = Obstacle("forearm", (0.06, 0.30, 0.06), at)
    scene = Scene((forearm,))
    velocity = np.array([0.0, -0.05, 0.03])

    def motion(time):
        moved = RigidTransform.from_translation(velocity * min(time, 2.0))
        return moved * side_plan.T_base_object

    run = Run(pr2, side_plan, motion)
    checker = CollisionChecker(pr2, scene)
    depths = []
    drive = run.arm.advance

    def advance(seconds):
        drive(seconds)
        moved = motion(run.arm.time) * side_plan.T_base_object.inv()
        checker.move_obstacles(("forearm",), moved)
        contact = checker.check(run.arm.commands[-1], side_plan.opening)
        depths.append(-0.005 if contact is None else contact.depth)

    run.arm.advance = advance
    run(body, blind_from=np.inf, scene=scene, carried=("forearm",))
    assert run.stages[0] == "moved"
    assert max(depths) < 0


def test_a_jump_of_the_object_sends_the_gripper_back_to_its_distance(pr2, side_plan, body):
    still = Run(pr2, side_plan)
    still(body, blind_from=np.inf)
    when = still.at["reached"][1] - 0.5  # the gripper is 40 mm away
    # Along the gap between the fingers.
    aside = side_plan.T_base_object * RigidTransform.from_translation([0.0, 0.08, 0.0])

    def motion(time):
        return side_plan.T_base_object if time < when else aside

    run = Run(pr2, side_plan, motion)
    execution = run(body, blind_from=np.inf)
    assert execution.is_held, execution
    wanted = side_plan.grasp.adapt(aside)
    first, last = (np.searchsorted(run.times(), t) for t in (when, run.at["reached"][1]))
    along = wanted.inv().apply(run.points(first, last))
    # It goes back to 100 mm, and comes nearer on its line only.
    assert along[:, 0].min() < -0.095
    again = along[np.argmin(along[:, 0]) :]
    near = again[again[:, 0] > -0.09]
    assert np.abs(near[:, 1:]).max() < 0.007
    run.check_speeds()


@pytest.mark.parametrize(("lag", "outcome"), [(0.04, "held"), (0.24, "left behind")])
def test_a_gripper_is_where_its_arm_is_not_where_that_was_told_to_be(
    pr2, side_plan, body, lag, outcome
):
    """Commands are on the grasp's line either way; the gripper is 12 mm beside it with the lag."""
    motion = constant_velocity(side_plan.T_base_object, (0.0, 0.06, 0.0))
    run = Run(pr2, side_plan, motion, lag=lag)
    execution = run(body, blind_from=np.inf, config=replace(CONFIG, following=1.0))
    assert execution.outcome == outcome, execution


def test_a_gripper_beside_its_line_goes_back(pr2, side_plan, body):
    slow = replace(CONFIG, following=1.0, patience=12.0, reach_speed=0.02)
    still = Run(pr2, side_plan, lag=0.25)
    still(body, blind_from=np.inf, config=slow)
    when = still.at["reached"][1] - 2.0  # the gripper is 40 mm away
    # From then on an arm that lags so is 15 mm beside the line.
    motion = constant_velocity(side_plan.T_base_object, (0.0, 0.06, 0.0), since=when)
    run = Run(pr2, side_plan, motion, lag=0.25)
    execution = run(body, blind_from=np.inf, config=slow)
    assert execution.outcome == "left behind", execution
    first, last = (np.searchsorted(run.times(), when + wait) for wait in (0.0, 3.0))
    times = run.times()[first:last] + CONFIG.lead
    grasps = [side_plan.grasp.adapt(motion(time)).inv() for time in times]
    points = [T.apply(p) for T, p in zip(grasps, run.points(first, last), strict=True)]
    along = np.array(points)[:, 0]
    assert along.max() > -0.045
    assert along[-1] < along.max() - 0.02


def test_a_gripper_leaves_an_object_that_moves_along_its_line(pr2, side_plan, body):
    motion = constant_velocity(side_plan.T_base_object, (0.0, 0.03, 0.01))
    run = Run(pr2, side_plan, motion, slippery_from=0.0)
    assert run(body, blind_from=np.inf).outcome == "missed"
    leaving = _leaving(run)
    assert leaving[-1, 0] == pytest.approx(-0.1, abs=0.002)
    assert np.abs(leaving[:, 1:]).max() < 0.003


def _opened(run):
    """Number of the first command after fingers that closed on nothing have opened again."""
    return int(np.searchsorted(run.times(), run.at["reached"][1] + CONFIG.closing + 0.5))


def _leaving(run):
    """m×3 positions of the gripper from there to its farthest, seen from the grasp."""
    first = _opened(run)
    times = run.times()[first:] + CONFIG.lead
    grasps = [run.plan.grasp.adapt(run.motion(time)).inv() for time in times]
    points = [T.apply(p) for T, p in zip(grasps, run.points(first), strict=True)]
    seen = np.array(points)[: round(0.1 / CONFIG.back_speed / CONFIG.period) + 2]
    return seen[: np.argmin(seen[:, 0]) + 1]
