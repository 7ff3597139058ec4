"""Collisions against distances known by construction, and against MuJoCo's pairwise distances."""

import mujoco
import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform
from planegrasp.robot import (
    CollisionChecker,
    CollisionConfig,
    Contact,
    ObjectBody,
    Obstacle,
    Robot,
    Scene,
)

AT = RigidTransform.from_translation
# From the tool frame to the end of the fingertips.
TIP = 0.07691 + 0.09737 + 0.024 - 0.18
TABLE = Obstacle("table", (0.6, 1.0, 0.05), AT((0.8, 0, 0.65)))
WALL = Obstacle("wall", (0.02, 0.5, 0.5), AT((0.5, -0.7, 1.0)))


def before_the_fingers(T_base_gripper, gap, thickness=0.02):
    """A plate whose face is `gap` before the fingertips."""
    at = T_base_gripper * AT((TIP + gap + thickness / 2, 0, 0))
    return Obstacle("plate", (thickness, 0.3, 0.3), at)


@pytest.mark.parametrize(
    ("gap", "margin", "depth"),
    [(0.003, 0.005, -0.003), (-0.004, 0.005, 0.004), (0.006, 0.005, None), (0.006, 0.01, -0.006)],
)
def test_depth_and_margin(pr2, gap, margin, depth):
    plate = before_the_fingers(pr2.T_base_gripper(pr2.home), gap)
    checker = CollisionChecker(pr2, Scene((plate,)), config=CollisionConfig(margin=margin))
    contact = checker.check(pr2.arm(pr2.home))
    if depth is None:
        assert contact is None
    else:
        assert contact.first in checker.fingers
        assert contact.second == "plate"
        assert contact.depth == pytest.approx(depth, abs=1e-6)


def test_the_opening_counts(pr2):
    T = pr2.T_base_gripper(pr2.home)
    body = ObjectBody((0.04, 0.060, 0.06), T_base_object=T)
    checker = CollisionChecker(pr2, Scene(object=body), config=CollisionConfig(margin=0.0))
    q = pr2.arm(pr2.home)
    assert checker.check(q, 0.062) is None
    contact = checker.check(q, 0.050)
    assert contact.second == "object"
    assert contact.depth == pytest.approx(0.005, abs=1e-6)
    assert checker.check(q, 0.050, allowed=checker.fingers_on_object) is None
    # The state's opening of 0.09 m again.
    assert checker.check(q) is None


def test_only_the_fingers_are_allowed_on_the_object(pr2):
    T = pr2.T_base_gripper(pr2.home)
    body = ObjectBody((0.20, 0.060, 0.06), T_base_object=T)
    checker = CollisionChecker(pr2, Scene(object=body))
    contact = checker.check(pr2.arm(pr2.home), 0.06, allowed=checker.fingers_on_object)
    assert contact.first == "r_wrist_roll_link"
    assert contact.second == "object"


def test_a_held_object_collides_where_the_gripper_carries_it(pr2):
    T = pr2.T_base_gripper(pr2.home)
    plate = before_the_fingers(T, 0.05)
    body = ObjectBody((0.1, 0.06, 0.06), T_gripper_object=AT((0.03, 0, 0)))
    checker = CollisionChecker(pr2, Scene((plate,), body))
    q = pr2.arm(pr2.home)
    fingers = checker.fingers_on_object
    contact = checker.check(q, 0.06, allowed=fingers)
    # Its front is 0.08 before the tool frame, the plate's 0.05 + TIP.
    assert contact == Contact("object", "plate", pytest.approx(0.03 - TIP, abs=1e-6))
    checker.set_object(body.held(AT((0.0, 0, 0))))
    assert checker.check(q, 0.06, allowed=fingers) is None
    checker.set_object(body.lying(T * AT((0.3, 0, 0))))
    assert checker.check(q, 0.06) is None
    checker.set_object(None)
    assert checker.check(q, 0.06) is None


def test_the_object_may_touch_what_supports_it(pr2):
    T = pr2.T_base_gripper(pr2.home)
    plate = before_the_fingers(T, 0.05)
    free = ObjectBody((0.1, 0.06, 0.06), T_gripper_object=AT((0.03, 0, 0)))
    supported = ObjectBody((0.1, 0.06, 0.06), T_gripper_object=AT((0.03, 0, 0)), supports={"plate"})
    checker = CollisionChecker(pr2, Scene((plate,), free))
    allowed = checker.fingers_on_object
    q = pr2.arm(pr2.home)
    assert checker.check(q, 0.06, allowed=allowed) is not None
    checker.set_object(supported)
    assert checker.check(q, 0.06, allowed=allowed) is None


def test_the_objects_centre_and_another_size(pr2):
    T = pr2.T_base_gripper(pr2.home)
    checker = CollisionChecker(pr2)
    q = pr2.arm(pr2.home)
    assert checker.check(q) is None
    # Its frame lies on the fingertips, its box 5 cm before them.
    T_tip = T * AT((TIP, 0, 0))
    checker.set_object(ObjectBody((0.04, 0.2, 0.2), T_base_object=T_tip, centre=(0.07, 0, 0)))
    assert checker.check(q) is None
    checker.set_object(ObjectBody((0.144, 0.2, 0.2), T_base_object=T_tip, centre=(0.07, 0, 0)))
    assert checker.check(q).depth == pytest.approx(0.002, abs=1e-6)


def test_the_arm_hits_the_robot(pr2):
    checker = CollisionChecker(pr2)
    down = np.array([0.0, 1.2, 0.0, -0.3, 0.0, -0.3, 0.0])
    lowered = pr2.with_joints(pr2.home, {"torso_lift": 0.0})
    contact = CollisionChecker(pr2, state=lowered).check(down)
    assert contact.second == "base_link"
    assert contact.depth > 0
    assert checker.check(pr2.arm(pr2.home)) is None


def test_against_distances_of_all_pairs(pr2):
    """A verdict for random postures, from MuJoCo's distance of each pair of shapes."""
    scene = Scene((TABLE, WALL))
    checker = CollisionChecker(pr2, scene, config=CollisionConfig(margin=0.01))
    spec = pr2.spec()
    for obstacle in scene.obstacles:
        body = spec.worldbody.add_body(name=obstacle.name, pos=obstacle.T_base_box.translation)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=np.array(obstacle.size) / 2)
    model = spec.compile()
    data = mujoco.MjData(model)
    excluded = {(signature >> 16, signature & 0xFFFF) for signature in model.exclude_signature}
    names = [model.body(body).name for body in model.geom_bodyid]
    obstacles = ("table", "wall")
    solid = [g for g in range(model.ngeom) if model.geom_contype[g]]
    pairs = []
    for i, a in enumerate(solid):
        for b in solid[i + 1 :]:
            bodies = sorted((int(model.geom_bodyid[a]), int(model.geom_bodyid[b])))
            welded = [int(model.body_weldid[body]) for body in bodies]
            parents = [int(model.body_weldid[model.body_parentid[w]]) for w in welded]
            # Of neighbours MuJoCo keeps those whose parent stands still.
            related = 0 not in welded and (welded[0] == parents[1] or welded[1] == parents[0])
            if welded[0] == welded[1] or tuple(bodies) in excluded or related:
                continue
            pairs.append((a, b))
    assert len(pairs) > 100
    rng = np.random.default_rng(4)
    low = np.where(pr2.continuous, -np.pi, pr2.soft_lower)
    high = np.where(pr2.continuous, np.pi, pr2.soft_upper)
    verdicts = []
    for _ in range(150):
        q = rng.uniform(low, high)
        data.qpos[:] = pr2.with_arm(pr2.home, q).qpos
        mujoco.mj_kinematics(model, data)
        distances = {
            (a, b): mujoco.mj_geomDistance(model, data, a, b, 0.02, None) for a, b in pairs
        }
        # Around a box's edges and corners the margin may be larger, up to √3 times.
        certain, possible = (
            {
                frozenset((names[a], names[b]))
                for (a, b), distance in distances.items()
                if distance < (reach if {names[a], names[b]} & set(obstacles) else 0.0)
            }
            for reach in (0.01, 0.01 * np.sqrt(3))
        )
        contact = checker.check(q)
        if contact is None:
            assert not certain
        else:
            assert frozenset((contact.first, contact.second)) in possible
        verdicts.append(contact is not None)
    assert 30 < sum(verdicts) < 120


def test_the_torso_carries_the_arm_out_of_reach(pr2):
    elbow = pr2.T_base("r_elbow_flex_link", pr2.home).translation
    below = Obstacle("shelf", (0.3, 0.3, 0.02), AT(elbow - (0, 0, 0.12)))
    q = pr2.arm(pr2.home)
    assert CollisionChecker(pr2, Scene((below,))).check(q) is None
    lowered = pr2.with_joints(pr2.home, {"torso_lift": 0.1})
    assert CollisionChecker(pr2, Scene((below,)), state=lowered).check(q).second == "shelf"


def test_poses_are_in_the_base_frame(six_dof_file):
    """The base frame is turned and moved away from the world's."""
    robot = Robot.from_file(six_dof_file, gripper_frame="tool", base_frame="stand")
    T = robot.T_base_gripper(robot.home)
    near = Obstacle("near", (0.05, 0.05, 0.05), T)
    checker = CollisionChecker(robot, Scene((near,)))
    assert checker.check(robot.arm(robot.home)).second == "near"
    far = Obstacle("far", (0.05, 0.05, 0.05), AT((0.3, -0.2, 0.5)) * T)
    assert CollisionChecker(robot, Scene((far,))).check(robot.arm(robot.home)) is None


def test_what_touches_at_home_does_not_count(six_dof_file):
    """The stand reaches into the first link, as a socket would; the others may hit it."""
    six_dof_file.write_text(six_dof_file.read_text().replace("0.1 0.1 0.05", "0.1 0.1 0.12"))
    robot = Robot.from_file(six_dof_file, gripper_frame="tool")
    checker = CollisionChecker(robot)
    rng = np.random.default_rng(5)
    contacts = [checker.check(rng.uniform(robot.lower, robot.upper)) for _ in range(500)]
    pairs = {(contact.first, contact.second) for contact in contacts if contact is not None}
    assert ("link6", "stand") in pairs
    assert ("link1", "stand") not in pairs
    assert None in contacts


def test_contacts_read_well():
    assert str(Contact("hand", "table", 0.0123)) == "hand is 12 mm deep in table"
    assert str(Contact("hand", "table", -0.0021)) == "hand is only 2 mm away from table"


def test_bad_scenes():
    pose = RigidTransform.identity()
    with pytest.raises(InvalidInputError, match="different names, got table, table"):
        Scene((TABLE, TABLE))
    with pytest.raises(InvalidInputError, match="name other than 'object'"):
        Obstacle("object", (1, 1, 1), pose)
    with pytest.raises(InvalidInputError, match=r"an edge of 'box' must be > 0 m.*-1"):
        Obstacle("box", (1, -1, 1), pose)
    with pytest.raises(InvalidInputError, match=r"\(x, y, z\) in metres"):
        Obstacle("box", (1, 1), pose)
    with pytest.raises(InvalidInputError, match="give one"):
        ObjectBody((1, 1, 1))
    with pytest.raises(InvalidInputError, match="give one"):
        ObjectBody((1, 1, 1), T_base_object=pose, T_gripper_object=pose)
    with pytest.raises(InvalidInputError, match="no obstacle is called shelf; there are: table"):
        Scene((TABLE,), ObjectBody((1, 1, 1), T_base_object=pose, supports={"shelf"}))
    with pytest.raises(InvalidInputError, match="margin must be ≥ 0 m"):
        CollisionConfig(margin=-0.001)


def test_an_opening_out_of_range(pr2):
    with pytest.raises(InvalidInputError, match=r"opens 0 … 0.090 m.*0\.2"):
        CollisionChecker(pr2).check(pr2.arm(pr2.home), 0.2)
