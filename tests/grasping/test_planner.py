"""Plans against the paper's equations and forward kinematics; refusals against what is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from plans import detection_of, grasps_of, with_grasps, within_reach
from small_arms import seven_dof_urdf

from planegrasp.detection import Detection
from planegrasp.errors import GraspError, InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation, euler_from_rotation, rotation_angle
from planegrasp.grasping import CanonicalGrasp
from planegrasp.grasping.obstacles import holding
from planegrasp.grasping.planner import GraspPlanner, PlannerConfig
from planegrasp.robot import Robot
from planegrasp.robot.collision import CollisionChecker, CollisionConfig
from planegrasp.robot.scene import ObjectBody, Obstacle, Scene

# What inverse kinematics may be off.
MILLIMETRE, RADIAN = 1e-4, 2e-4


def axes(x, y, position):
    x, y = np.array(x, float), np.array(y, float)
    R = Rotation.from_matrix(np.column_stack([x, y, np.cross(x, y)]))
    return RigidTransform.from_components(position, R)


def assert_near(T, expected):
    assert np.linalg.norm(T.translation - expected.translation) < MILLIMETRE
    assert rotation_angle(T.rotation, expected.rotation) < RADIAN


def gripper_at(robot, q):
    return robot.T_base_gripper(robot.with_arm(robot.home, q))


def check_paths(robot, plan, lift=0.12):
    """The paths by the robot's own forward kinematics, not that of the planner."""
    start = robot.arm(robot.home)
    np.testing.assert_array_equal(plan.move.start, start)
    np.testing.assert_allclose(plan.reach.start, plan.move.end, atol=1e-9)
    np.testing.assert_allclose(plan.lift.start, plan.reach.end, atol=1e-9)
    assert_near(gripper_at(robot, plan.move.end), plan.T_base_pregrasp)
    assert_near(gripper_at(robot, plan.reach.end), plan.T_base_gripper)
    raised = RigidTransform.from_translation([0.0, 0.0, lift]) * plan.T_base_gripper
    assert_near(gripper_at(robot, plan.lift.end), raised)
    for path in (plan.move, plan.reach, plan.lift):
        assert np.all(path.q >= robot.soft_lower - 1e-9)
        assert np.all(path.q <= robot.soft_upper + 1e-9)
        assert np.abs(np.diff(path.q, axis=0)).max(initial=0.0) < 0.05
    for path in (plan.reach, plan.lift):
        ends = [gripper_at(robot, q) for q in (path.start, path.end)]
        way = ends[1].translation - ends[0].translation
        along = way / np.linalg.norm(way)
        progress = []
        for q in path.q:
            T = gripper_at(robot, q)
            moved = T.translation - ends[0].translation
            progress.append(along @ moved)
            # Between two poses 5 mm apart the joints go straight, not quite the gripper.
            assert np.linalg.norm(moved - progress[-1] * along) < 5e-4
            assert rotation_angle(T.rotation, ends[0].rotation) < 2e-3
        assert np.all(np.diff(progress) > -1e-6)


def test_the_plan_is_the_taught_grasp_at_the_detected_object(pr2, carton_model, before_pr2):
    T_base_camera = pr2.T_base_camera(pr2.home)
    detection = detection_of(carton_model, T_base_camera.inv() * before_pr2)
    plan = GraspPlanner(pr2).plan(detection, T_base_camera)
    assert plan
    assert not plan.refused
    assert plan.name == "cracker-box"
    taught = next(g for g in carton_model.grasps if g.name == plan.grasp.name)
    expected = before_pr2.as_matrix() @ taught.T_object_gripper.as_matrix()  # eq. 11
    np.testing.assert_allclose(plan.T_base_gripper.as_matrix(), expected, atol=1e-12)
    back = np.eye(4)
    back[0, 3] = -taught.pregrasp_distance
    np.testing.assert_allclose(plan.T_base_pregrasp.as_matrix(), expected @ back, atol=1e-12)
    np.testing.assert_allclose(plan.T_base_object.as_matrix(), before_pr2.as_matrix(), atol=1e-12)
    assert plan.euler == euler_from_rotation(plan.T_base_gripper.rotation)  # eq. 12
    assert (plan.opening, plan.force) == (taught.opening, taught.force)
    assert set(plan.seconds) == {"selection", "motion"}
    check_paths(pr2, plan)


def test_the_best_accepted_grasp_is_taken(pr2, carton_model, before_pr2):
    plan = GraspPlanner(pr2).plan_at(carton_model, before_pr2)
    chosen, *others = plan.assessments
    assert chosen.grasp == plan.grasp.name
    assert {a.grasp for a in plan.assessments} == {g.name for g in carton_model.grasps}
    assert all(0 < a.score <= chosen.score for a in others if a.accepted)
    assert all(a.reason and a.score == 0 for a in others if not a.accepted)
    assert plan.reasons == {a.grasp: a.reason for a in others if not a.accepted}
    # 85 mm opening around 60 mm of box.
    assert chosen.figures["clearance"] == pytest.approx(0.0125, abs=1e-6)
    # Without the best, the next best is taken, with the score it had.
    accepted = [a for a in others if a.accepted]
    assert accepted
    names = [a.grasp for a in others]
    second = GraspPlanner(pr2).plan_at(with_grasps(carton_model, *names), before_pr2)
    assert second.grasp.name == accepted[0].grasp
    assert second.assessments[0].score == pytest.approx(accepted[0].score)


def test_the_same_seed_gives_the_same_plan(pr2, carton_model, before_pr2):
    plans = [GraspPlanner(pr2).plan_at(carton_model, before_pr2) for _ in range(2)]
    for name in ("move", "reach", "lift"):
        np.testing.assert_array_equal(getattr(plans[0], name).q, getattr(plans[1], name).q)
    assert plans[0].grasp is plans[1].grasp


def test_the_height_of_the_lift_is_configured(pr2, carton_model, before_pr2):
    plan = GraspPlanner(pr2, PlannerConfig(lift=0.05)).plan_at(
        with_grasps(carton_model, "side"), before_pr2
    )
    check_paths(pr2, plan, lift=0.05)


def test_nothing_on_the_paths_touches_the_object(pr2, carton_model, before_pr2, side_plan):
    body = carton_model.outer_body
    lying = ObjectBody(body.size, before_pr2, None, body.centre)
    checker = CollisionChecker(pr2, Scene(object=lying))
    opening = side_plan.opening
    assert all(checker.check(q, opening) is None for q in side_plan.move.q)
    fingers = checker.fingers_on_object
    assert all(checker.check(q, opening, allowed=fingers) is None for q in side_plan.reach.q)


def reason(robot, model, T_base_object, **arguments):
    refusal = GraspPlanner(robot).plan_at(model, T_base_object, **arguments)
    assert not refusal
    assert refusal.refused
    assert set(refusal.reasons) == {g.name for g in model.grasps}
    return next(iter(refusal.reasons.values()))


def test_a_grasp_wider_than_the_gripper_is_refused(pr2, carton_model, before_pr2):
    wide = replace(carton_model, grasps=grasps_of(carton_model.outer_body, opening=0.12)[:1])
    message = "needs the fingertips 120.0 mm apart, the gripper opens to 90.0 mm"
    assert reason(pr2, wide, before_pr2) == message


def test_an_object_wider_than_the_opening_is_refused(pr2, carton_model, before_pr2):
    narrow = replace(carton_model, grasps=grasps_of(carton_model.outer_body, opening=0.055)[:1])
    message = "does not fit between the fingers: 60 mm in an opening of 55 mm"
    assert message in reason(pr2, narrow, before_pr2)


@pytest.mark.parametrize("distance", [1.5, 3.0])
def test_out_of_reach_says_how_far(pr2, carton_model, before_pr2, distance):
    away = RigidTransform.from_translation([distance - 0.62, 0.0, 0.0]) * before_pr2
    text = reason(pr2, with_grasps(carton_model, "side"), away)
    assert text.startswith("unreachable: ")
    assert text.endswith("m outside the workspace")
    shoulder = next(t for t in text.split() if t.replace(".", "").isdigit())
    # The arm is about 0.95 m long with the gripper, its shoulder about at x = 0.
    assert float(shoulder) == pytest.approx(distance - 0.9, abs=0.2)


def test_an_object_that_points_at_the_robot_is_refused(pr2, carton_model):
    # The right side looks away from the robot: the gripper would have to come from beyond.
    upright = axes([1, 0, 0], [0, 0, 1], [0.8, -0.1, 0.9])
    flat = axes([1, 0, 0], [0, 1, 0], [0.8, -0.1, 0.9])
    for T in (upright, flat):
        text = reason(pr2, with_grasps(carton_model, "side"), T)
        assert "unreachable" in text
        assert "mm off" in text or "outside the workspace" in text


def test_what_is_in_the_way_is_named(pr2, carton_model, before_pr2, side_plan):
    model = with_grasps(carton_model, "side")
    palm = side_plan.T_base_gripper * RigidTransform.from_translation([-0.15, 0.0, 0.0])
    shelf = Obstacle("shelf", (0.05, 0.05, 0.05), palm)
    text = reason(pr2, model, before_pr2, scene=Scene((shelf,)))
    assert text.startswith("in collision: ")
    assert "shelf" in text
    # Only lifting brings the box to a lid above it.
    above = before_pr2.apply([0.0, 0.105, 0.0]) + np.array([0.0, 0.0, 0.08])
    lid = Obstacle("lid", (0.02, 0.02, 0.02), RigidTransform.from_translation(above))
    text = reason(pr2, model, before_pr2, scene=Scene((lid,)))
    assert text.startswith("it cannot be lifted by 0.12 m: ")
    assert "lid" in text


def test_a_start_in_collision_is_refused(pr2, carton_model, before_pr2):
    palm = pr2.T_base_gripper(pr2.home) * RigidTransform.from_translation([-0.12, 0.0, 0.0])
    crate = Obstacle("crate", (0.06, 0.06, 0.06), palm)
    text = reason(pr2, with_grasps(carton_model, "side"), before_pr2, scene=Scene((crate,)))
    assert text.startswith("no way to its pre-grasp: at the start, ")
    assert "crate" in text


def test_an_obstacle_that_supports_the_object_may_touch_it(pr2, carton_model, before_pr2):
    model = with_grasps(carton_model, "side")
    below = before_pr2 * RigidTransform.from_translation([0.0, -0.1195, 0.0])
    post = Obstacle("post", (0.03, 0.03, 0.03), below)
    planner = GraspPlanner(pr2)
    text = reason(pr2, model, before_pr2, scene=Scene((post,)))
    assert "post" in text
    assert planner.plan_at(model, before_pr2, scene=Scene((post,)), supports=("post",))
    with pytest.raises(InvalidInputError, match="no obstacle is called pole"):
        planner.plan_at(model, before_pr2, scene=Scene((post,)), supports=("pole",))


def test_a_support_that_is_above_stops_the_lift(pr2, carton_model, before_pr2):
    """What is 15 mm above counts as holding the object, but it does not go through it."""
    model = with_grasps(carton_model, "side")
    half = np.array(model.outer_body.size) / 2

    def board(y):
        return Obstacle(
            "board", (0.05, 0.02, 0.1), before_pr2 * RigidTransform.from_translation([-0.04, y, 0])
        )

    planner = GraspPlanner(pr2)
    above = Scene((board(half[1] + 0.025),))
    assert holding(above.obstacles, before_pr2, model.outer_body) == ("board",)
    refused = planner.plan_at(model, before_pr2, scene=above, supports=("board",))
    assert not refused
    assert refused.reasons["side"].endswith("object goes into board")
    below = Scene((board(-half[1] - 0.011),))
    assert planner.plan_at(model, before_pr2, scene=below, supports=("board",))


def test_without_grasps_it_says_how_to_teach_one(pr2, carton_model, before_pr2):
    refusal = GraspPlanner(pr2).plan_at(replace(carton_model, grasps=[]), before_pr2)
    assert not refusal
    assert "no grasp is taught" in refusal.reason
    assert refusal.reasons == {}


def test_two_grasps_of_one_name_are_an_error(pr2, carton_model, before_pr2):
    grasp = carton_model.grasps[0]
    with pytest.raises(GraspError, match="two grasps named 'side'"):
        GraspPlanner(pr2).plan_at(replace(carton_model, grasps=[grasp, grasp]), before_pr2)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        ({"depth_pixels": 0}, "no depth was measured on the object"),
        ({"ambiguous": True}, "the pose is ambiguous"),
        ({"covariance": None}, "the pose has no covariance"),
        (
            {"covariance": np.diag([1e-6, 0.03**2, 1e-6, 1e-6, 1e-6, 1e-6])},
            "the position is uncertain by 30.0 mm (one sigma), at most 20.0 mm are accepted",
        ),
        (
            {"covariance": np.diag([1e-6, 1e-6, 1e-6, 1e-6, 1e-6, np.radians(5) ** 2])},
            "the rotation is uncertain by 5.0° (one sigma), at most 3.0° are accepted",
        ),
        ({"covariance": np.full((6, 6), -1.0)}, "the position is uncertain by"),
    ],
)
def test_a_doubtful_pose_is_refused(pr2, carton_model, before_pr2, pose, message):
    T_base_camera = pr2.T_base_camera(pr2.home)
    seen = detection_of(carton_model, T_base_camera.inv() * before_pr2, **pose)
    refusal = GraspPlanner(pr2).plan(seen, T_base_camera)
    assert not refusal
    assert message in refusal.reason
    assert set(refusal.reasons) == {g.name for g in carton_model.grasps}
    assert set(refusal.reasons.values()) == {refusal.reason}


def test_depth_is_needed_only_where_asked_for(pr2, carton_model, before_pr2):
    T_base_camera = pr2.T_base_camera(pr2.home)
    seen = detection_of(carton_model, T_base_camera.inv() * before_pr2, depth_pixels=0)
    assert GraspPlanner(pr2, PlannerConfig(need_depth=False)).plan(seen, T_base_camera)


def test_a_detection_without_pose_is_refused(pr2, carton_model):
    blind = Detection(carton_model, 0, (), 1.0, None, "too few points")
    refusal = GraspPlanner(pr2).plan(blind, pr2.T_base_camera(pr2.home))
    assert refusal.reason == "the detection has no pose: too few points"


def test_a_pose_too_uncertain_for_the_clearance_is_refused(pr2, carton_model, before_pr2):
    # 10 mm along z, across which the fingers close with 12.5 mm to spare: 79 % fit.
    sure = np.diag([1e-8, 1e-8, 0.010**2, 1e-8, 1e-8, 1e-8])
    unsure = np.diag([1e-8, 1e-8, 0.015**2, 1e-8, 1e-8, 1e-8])
    model, planner = with_grasps(carton_model, "side"), GraspPlanner(pr2)
    plan = planner.plan_at(model, before_pr2, covariance=sure)
    assert plan.assessments[0].figures["closing_sigma"] == pytest.approx(0.010, rel=0.01)
    text = reason(pr2, model, before_pr2, covariance=unsure)
    assert "15.0 mm (one sigma) between fingers with 12.5 mm to spare" in text
    # Along the approach it may be as uncertain as one likes.
    assert planner.plan_at(model, before_pr2, covariance=np.diag([0.015**2, *[1e-8] * 5]))


@pytest.mark.parametrize(
    "arguments", [{"lift": 0.0}, {"fit": 1.0}, {"translation_sigma": -1.0}, {"seed": -1}]
)
def test_a_config_out_of_range_is_refused(arguments):
    with pytest.raises(InvalidInputError, match=next(iter(arguments))):
        PlannerConfig(**arguments)


def test_a_robot_without_gripper_cannot_plan(tmp_path):
    path = tmp_path / "seven.urdf"
    path.write_text(seven_dof_urdf())
    robot = Robot.from_file(path, gripper_frame="tool", base_frame="base")
    with pytest.raises(InvalidInputError, match="a robot without gripper cannot grasp"):
        GraspPlanner(robot)


def test_any_robot_plans(other_robot, card):
    plan_config = PlannerConfig(lift=0.05)
    T_base_object = within_reach(other_robot, card)
    plan = GraspPlanner(other_robot, plan_config).plan_at(card, T_base_object)
    assert plan, plan.reasons
    check_paths(other_robot, plan, lift=0.05)
    far = RigidTransform.from_translation([0.0, 0.0, 3.0]) * T_base_object
    assert "outside the workspace" in reason(other_robot, card, far)


def test_a_grasp_is_only_as_good_as_its_approach(pr2, carton_model, before_pr2):
    # Against the palm's direction the gripper would have to come through the box.
    side = next(g for g in carton_model.grasps if g.name == "side")
    through = CanonicalGrasp(
        "through", side.T_object_gripper, side.opening, approach=(-1.0, 0.0, 0.0)
    )
    text = reason(pr2, replace(carton_model, grasps=[through]), before_pr2)
    assert text.startswith("no straight way to it: ")
    assert "object" in text


@pytest.mark.parametrize("y", [-1.0, 1.0])
def test_a_finger_does_not_go_through_the_object(pr2, carton_model, before_pr2, y):
    """Along y one of the open fingers would have to come through the box, along z none."""
    side = next(g for g in carton_model.grasps if g.name == "side")
    grasps = [replace(side, name="across", approach=(0.0, y, 0.0))]
    text = reason(pr2, replace(carton_model, grasps=grasps), before_pr2)
    assert text.startswith("no straight way to it: on it, r_gripper_")
    assert text.endswith("deep in object")
    grasps = [replace(side, name="along", approach=(0.0, 0.0, y))]
    plan = GraspPlanner(pr2).plan_at(replace(carton_model, grasps=grasps), before_pr2)
    assert plan, plan.reasons
    check_paths(pr2, plan)


def test_transforms_may_be_matrices_and_must_be_finite(pr2, carton_model, before_pr2):
    T_base_camera = pr2.T_base_camera(pr2.home)
    detection = detection_of(carton_model, T_base_camera.inv() * before_pr2)
    planner = GraspPlanner(pr2)
    plan = planner.plan(detection, T_base_camera.as_matrix())
    assert plan, plan.reasons
    assert_near(plan.T_base_object, before_pr2)
    nowhere = RigidTransform.from_translation([np.nan, 0.0, 0.0])
    with pytest.raises(InvalidInputError, match=r"^T_base_camera: .* finite"):
        planner.plan(detection, nowhere)
    with pytest.raises(InvalidInputError, match=r"^T_base_object: .* finite"):
        planner.plan_at(carton_model, nowhere)


def test_what_leaves_with_the_grip_is_not_in_the_way_of_the_lift(
    pr2, carton_model, before_pr2, side_plan
):
    """A hand above the palm is in the way of the lift, until it has let go."""
    model = with_grasps(carton_model, "side")
    over = side_plan.T_base_gripper.apply([-0.12, 0.0, 0.0]) + np.array([0.0, 0.0, 0.10])
    hand = Obstacle("hand", (0.03, 0.03, 0.03), RigidTransform.from_translation(over))
    planner, scene = GraspPlanner(pr2), Scene((hand,))
    stays = planner.plan_at(model, before_pr2, scene=scene, supports=("hand",))
    assert not stays
    assert "cannot be lifted" in stays.reasons["side"]
    assert "hand" in stays.reasons["side"]
    leaves = planner.plan_at(model, before_pr2, scene=scene, supports=("hand",), leaving=("hand",))
    assert leaves
    check_paths(pr2, leaves)
    with pytest.raises(InvalidInputError, match="no obstacle is called foot"):
        planner.plan_at(model, before_pr2, scene=scene, leaving=("foot",))


def test_the_grasp_with_more_room_to_a_person_is_preferred(pr2, carton_model, before_pr2):
    planner = GraspPlanner(pr2, PlannerConfig(sidestep=0.0))
    before = planner.plan_at(carton_model, before_pr2)
    assert before
    # A hand that is nearly where the gripper would be, and moves.
    beside = before.T_base_gripper * RigidTransform.from_translation([-0.06, 0.0, 0.07])
    hand = Obstacle("hand", (0.03, 0.03, 0.03), beside)
    scene = Scene((hand,))
    stays = planner.plan_at(carton_model, before_pr2, scene=scene)
    assert stays
    assert stays.grasp.name == before.grasp.name
    assert "room" not in stays.assessments[0].figures
    moves = planner.plan_at(carton_model, before_pr2, scene=scene, leaving=("hand",))
    assert moves
    assert moves.grasp.name != before.grasp.name
    room = {a.grasp: a.figures["room"] for a in moves.assessments if a.accepted}
    assert room[before.grasp.name] < 0.03
    assert room[moves.grasp.name] > 0.06
    # It is preferred, not demanded.
    only = with_grasps(carton_model, before.grasp.name)
    assert planner.plan_at(only, before_pr2, scene=scene, leaving=("hand",))


def test_a_way_with_room_is_preferred(pr2, carton_model, before_pr2, side_plan):
    model = with_grasps(carton_model, "side")
    # Above the gripper in the middle of the way that it would take.
    middle = gripper_at(pr2, side_plan.move.q[len(side_plan.move.q) // 2])
    above = RigidTransform.from_translation(middle.translation + np.array([0.0, 0.0, 0.06]))
    hand = Obstacle("hand", (0.03, 0.03, 0.03), above)
    wide = CollisionChecker(pr2, Scene((hand,)), config=CollisionConfig(margin=0.0299))

    def is_roomy(plan):
        assert plan
        return all(wide.check(q, plan.opening) is None for q in plan.move.q)

    planner, scene = GraspPlanner(pr2), Scene((hand,))
    narrow = GraspPlanner(pr2, PlannerConfig(wide_margin=0.0))
    assert not is_roomy(narrow.plan_at(model, before_pr2, scene=scene))
    assert is_roomy(planner.plan_at(model, before_pr2, scene=scene))
    assert is_roomy(planner.plan_at(model, before_pr2, scene=scene, leaving=("hand",)))
    # Where the pre-grasp itself is nearer, the usual margin does.
    beside = RigidTransform.from_translation([-0.02, 0.0, 0.06])
    near = Obstacle("hand", (0.03, 0.03, 0.03), side_plan.T_base_pregrasp * beside)
    assert planner.plan_at(model, before_pr2, scene=Scene((near,)), leaving=("hand",))


def test_a_grasp_close_to_a_person_is_moved_aside(pr2, carton_model, before_pr2):
    model = with_grasps(carton_model, "bottom")
    taught = model.grasps[0]
    beside = taught.adapt(before_pr2) * RigidTransform.from_translation([-0.06, 0.0, 0.07])
    scene = Scene((Obstacle("hand", (0.03, 0.03, 0.03), beside),))
    there, aside = (
        GraspPlanner(pr2, PlannerConfig(sidestep=step)).plan_at(
            model, before_pr2, scene=scene, leaving=("hand",)
        )
        for step in (0.0, 0.015)
    )
    assert there
    assert aside
    assert_near(there.T_base_gripper, taught.adapt(before_pr2))
    # Away from the hand, along the pads.
    away = RigidTransform.from_translation([0.0, 0.0, -0.015])
    assert_near(aside.T_base_gripper, taught.adapt(before_pr2) * away)
    assert aside.grasp.name == "bottom"
    check_paths(pr2, aside)
    figures = [plan.assessments[0].figures for plan in (there, aside)]
    assert figures[1]["room"] == pytest.approx(figures[0]["room"] + 0.015, abs=0.002)
    assert "aside" not in figures[0]
    assert figures[1]["aside"] == 0.015
    # A thing on a shelf is gripped as it was taught.
    shelf = GraspPlanner(pr2).plan_at(model, before_pr2, scene=scene)
    assert shelf
    assert_near(shelf.T_base_gripper, taught.adapt(before_pr2))


def test_a_little_less_lift_than_wanted_will_do(pr2, carton_model, before_pr2):
    model = with_grasps(carton_model, "side")
    top = before_pr2.apply(model.outer_body.corners)[:, 2].max()
    middle = before_pr2.translation

    def below(height):
        place = [middle[0], middle[1], top + height + 0.01]
        lid = Obstacle("lid", (0.1, 0.1, 0.02), RigidTransform.from_translation(place))
        return GraspPlanner(pr2).plan_at(model, before_pr2, scene=Scene((lid,)))

    lower = below(0.115)
    assert lower
    ends = [gripper_at(pr2, q).translation[2] for q in (lower.lift.start, lower.lift.end)]
    assert 0.105 <= ends[1] - ends[0] < 0.115
    check_paths(pr2, lower, lift=ends[1] - ends[0])
    refused = below(0.10)
    assert not refused
    assert "cannot be lifted by 0.12 m" in refused.reasons["side"]
