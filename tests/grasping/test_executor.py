"""Plans carried out by an ideal arm: what is done, in which order, how fast, and the way back."""

from dataclasses import replace

import numpy as np
import pytest
from ideal_arm import IdealArm, ScriptedEyes, constant_velocity
from plans import within_reach
from small_arms import seven_dof_urdf

from planegrasp.errors import InvalidInputError, RobotError
from planegrasp.geometry import RigidTransform, rotation_angle
from planegrasp.grasping.executor import ExecutorConfig, GraspExecutor
from planegrasp.grasping.planner import GraspPlanner, PlannerConfig
from planegrasp.robot import Robot
from planegrasp.robot.collision import CollisionChecker
from planegrasp.robot.path import Path
from planegrasp.robot.scene import ObjectBody, Obstacle, Scene

CONFIG = ExecutorConfig(lead=0.02, patience=4.0)  # an ideal arm is there after one period


class Run:
    """One execution, with what is to be known of it afterwards."""

    def __init__(self, robot, plan, motion=None, *, start=None, **changes):
        self.robot, self.plan = robot, plan
        still = constant_velocity(plan.T_base_object, (0.0, 0.0, 0.0))
        self.motion = motion or still
        self.arm = IdealArm(robot, start or robot.home, self.motion, plan.grasp)
        for name, value in changes.items():
            setattr(self.arm, name, value)
        self.stages, self.at = [], {}

    def __call__(self, body, *, blind_from=None, config=CONFIG, **arguments):
        if blind_from is not None:
            eyes = ScriptedEyes(self.arm, self.motion, blind_from)
            arguments = {"eyes": eyes, "sighting": eyes.sighting(0.0), **arguments}
        self.execution = GraspExecutor(self.robot, config).run(
            self.plan, self.arm, body, notify=self.note, **arguments
        )
        return self.execution

    def note(self, stage):
        self.stages.append(stage)
        self.at[stage] = (len(self.arm.commands), self.arm.time, self.arm.T_base_gripper)

    def points(self, first=0, last=None):
        """m×3 positions of the gripper."""
        states = (self.robot.with_arm(self.arm.state, q) for q in self.arm.commands[first:last])
        return np.array([self.robot.T_base_gripper(state).translation for state in states])

    def times(self):
        """When each command was given."""
        return np.array(self.arm.given)

    def check_speeds(self, config=CONFIG):
        steps = np.abs(np.diff(self.arm.commands, axis=0))
        limits = self.robot.velocity_limits * config.speed * config.period
        # The path's velocity is limited at its points, a cubic between them is that much faster.
        assert (steps / limits).max() < 1.001

    def check_retreat(self):
        """At home again, open, by the way that the arm came."""
        np.testing.assert_allclose(self.arm.commands[-1], self.arm.commands[0], atol=1e-9)
        assert self.arm.grips[-1] == (self.plan.opening, self.plan.force)
        # The last command that was new when it turned back.
        commands = np.array(self.arm.commands)
        turn = self.turning_point()
        coming, going = commands[: turn + 1], commands[turn + 1 :]
        for q in going:
            # Between two points 0.02 rad apart, or at a corner that a spline rounds.
            assert np.abs(coming - q).max(axis=1).min() < 0.03
        self.check_speeds()

    def turning_point(self):
        same = np.abs(np.diff(self.arm.commands, axis=0)).max(axis=1) == 0.0
        return int(np.flatnonzero(same)[-1]) if same.any() else len(self.arm.commands) - 1


@pytest.fixture
def body(carton_model):
    return carton_model.outer_body


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


def test_fingers_that_flicker_press(pr2, side_plan, body):
    steady = Run(pr2, side_plan)
    steady(body)
    run = Run(pr2, side_plan, flicker=0.1)
    assert run(body).is_held
    # As soon as those that press all the time.
    took = [r.at["closed"][1] - r.at["reached"][1] for r in (run, steady)]
    assert took[0] == pytest.approx(took[1], abs=0.021)


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
