"""Obstacles from depth against scenes whose geometry is known: planes and boxes, cast exactly."""

import numpy as np
import pytest

from planegrasp.body import BoxBody
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.rgbd import RGBDFrame
from planegrasp.simulation.depth_sensor import KinectV1

pytest.importorskip("mujoco")

from planegrasp.grasping.obstacles import (
    ObstacleConfig,
    holding,
    obstacles_from_depth,
)
from planegrasp.robot import CollisionChecker, ObjectBody, Obstacle, Robot, Scene

AT = RigidTransform.from_translation
# A Kinect has edges of 3 px in images of this size.
CAMERA = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5)
# The camera looks along the base's x from a height of 1 m.
T_BASE_CAMERA = RigidTransform.from_components(
    [0.0, 0.0, 1.0], Rotation.from_matrix([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
)
BODY = BoxBody((0.16, 0.21, 0.06))
# 0.9 m before the camera, the face turned to it and then away, by 0.3 rad.
T_BASE_OBJECT = RigidTransform.from_components(
    [0.9, 0.0, 1.0],
    Rotation.from_matrix([[0, 0, -1], [-1, 0, 0], [0, 1, 0]]) * Rotation.from_euler("y", 0.3),
)
FAR = 3.0


def cast(boxes):
    """Depth of solid boxes (size, T_base_box) before a wall at 3 m, by the slab method."""
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    rays = CAMERA.rays(np.column_stack([u.ravel(), v.ravel()]).astype(float))
    depth = np.full(len(rays), FAR)
    for size, T_base_box in boxes:
        T_box_camera = T_base_box.inv() * T_BASE_CAMERA
        origin, way = T_box_camera.translation, T_box_camera.rotation.apply(rays)
        way = np.where(way == 0, 1e-15, way)
        ends = np.stack([(sign * np.array(size) / 2 - origin) / way for sign in (-1, 1)])
        enters, leaves = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
        depth = np.where((enters <= leaves) & (enters > 0), np.minimum(depth, enters), depth)
    return depth.reshape(v.shape)


def frame_of(depth):
    color = np.zeros((*depth.shape, 3), np.uint8)
    return RGBDFrame(color, depth.astype(np.float32), CAMERA)


def object_box():
    return BODY.size, T_BASE_OBJECT * AT(BODY.centre)


def beside(x, y, z, size):
    """A box at a place in the object's frame, along its axes."""
    return size, T_BASE_OBJECT * AT((x, y, z))


# A thumb before the face, a palm around its right edge, and a post that touches nothing.
THUMB = beside(0.06, 0.0, 0.030 + 0.0125, (0.06, 0.025, 0.025))
PALM = beside(0.08 + 0.045, 0.0, 0.0, (0.07, 0.09, 0.08))
POST = ((0.04, 0.04, 0.6), AT((0.85, 0.35, 1.0)))


def seen(boxes, rng=None, **config):
    depth = cast([object_box(), *boxes])
    if rng is not None:
        depth = KinectV1().measure(depth, rng)
    return obstacles_from_depth(
        frame_of(depth), T_BASE_CAMERA, T_BASE_OBJECT, BODY, config=ObstacleConfig(**config)
    )


def surface(boxes):
    """Points of the boxes' surfaces that are seen, not those of the object or the wall; base."""
    depth = cast([object_box(), *boxes])
    alone = cast([object_box()])
    v, u = np.nonzero((depth < alone - 1e-9) & (depth < FAR))
    rays = CAMERA.rays(np.column_stack([u, v]).astype(float))
    return np.asarray(T_BASE_CAMERA.apply(rays * depth[v, u, None]))


def distance(points, obstacles):
    """Of each point to the nearest obstacle [m]."""
    distances = [np.full(len(points), np.inf)]
    for box in obstacles:
        outside = np.abs(box.T_base_box.inv().apply(points)) - np.array(box.size) / 2
        distances.append(np.linalg.norm(np.maximum(outside, 0.0), axis=1))
    return np.min(distances, axis=0)


def corners(box, grown=0.0):
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return box.T_base_box.apply(signs * (np.array(box.size) / 2 + grown))


def test_boxes_cover_what_is_seen():
    obstacles = seen([THUMB, PALM, POST])
    points = surface([THUMB, PALM, POST])
    away = distance(points, obstacles)
    # What is left out are slivers in cells with few points, and what noise may have moved off the
    # object: 3 σ at 0.9 m are 6 mm along the line of sight, and 6 mm are the margin.
    assert np.mean(away < 1e-6) > 0.9
    assert away.max() < 0.015


def test_boxes_cover_noisy_measurements():
    obstacles = seen([THUMB, PALM, POST], np.random.default_rng(3))
    # The nearest pixels of a noisy frame differ by no more than a few σ of 2 mm.
    away = distance(surface([THUMB, PALM, POST]), obstacles)
    assert np.quantile(away, 0.95) < 0.005
    assert away.max() < 0.02


@pytest.mark.parametrize("rng", [None, 0, 1])
def test_no_box_reaches_into_the_body_or_far_from_what_is_there(rng):
    rng = None if rng is None else np.random.default_rng(rng)
    things = [THUMB, PALM, POST]
    obstacles = seen(things, rng)
    assert obstacles
    half = np.array(BODY.size) / 2
    for box in obstacles:
        # Both lie along the object's axes: they overlap where they do along each.
        middle = T_BASE_OBJECT.inv().apply(box.T_base_box.translation)
        apart = np.abs(middle - BODY.centre) - half - np.array(box.size) / 2
        assert apart.max() > -1e-3
        # The thickness behind what is seen, and noise.
        true = [Obstacle(f"{i}", size, T) for i, (size, T) in enumerate(things)]
        assert distance(corners(box), true).max() < ObstacleConfig().thickness + 0.03


def test_the_object_alone_is_no_obstacle():
    assert seen([]) == ()
    for seed in range(5):
        assert seen([], np.random.default_rng(seed)) == ()


def test_a_thumb_before_the_face_is_one():
    (size, T) = THUMB
    for rng in (None, np.random.default_rng(0)):
        obstacles = seen([THUMB], rng)
        front = T.apply([[-0.02, 0.0, size[2] / 2], [0.02, 0.0, size[2] / 2]])
        assert distance(front, obstacles).max() < 0.008


def test_what_is_seen_goes_on_behind():
    block = (0.2, 0.2, 0.2), AT((0.95, 0.25, 1.0))
    # Its front is at 0.85 m, its visible side at 0.15 m.
    behind = np.array([[0.89, 0.27, 1.0]])
    assert distance(behind, seen([block], thickness=0.06)).max() < 1e-6
    # A box around a surface that is turned by 0.3 rad against the cells is up to one, 2.5 cm, deep.
    assert distance(behind, seen([block], thickness=0.0)).max() > 0.04 * np.cos(0.3) - 0.025


def test_what_leaves_the_image_goes_on_beyond_it():
    # An arm from the object's lower edge down; at this distance the image ends 0.41 m below.
    arm = ((0.05, 0.05, 0.5), AT((0.9, 0.0, 1.0 - 0.105 - 0.25)))
    ends = np.array([[0.88, 0.0, 0.5]])
    assert distance(ends, seen([arm])).max() < 1e-6
    assert distance(ends, seen([arm], beyond=0.0)).max() > 0.05
    # What ends within the image ends there.
    short = ((0.05, 0.05, 0.2), AT((0.9, 0.0, 1.0 - 0.105 - 0.1)))
    below = np.array([[0.88, 0.0, 0.65]])
    assert distance(below, seen([short])).max() > 0.02
    # It holds the object as what is seen of it does.
    boxes = seen([arm])
    assert set(holding(boxes, T_BASE_OBJECT, BODY)) == {box.name for box in boxes}


def test_names_are_different_and_boxes_few():
    rng = np.random.default_rng(0)
    rubble = [
        (tuple(rng.uniform(0.02, 0.05, 3)), AT(rng.uniform([0.6, -0.35, 0.7], [1.1, 0.35, 1.3])))
        for _ in range(60)
    ]
    many = seen(rubble, most=1000)
    assert len(many) > 80
    few = seen(rubble)
    assert 0 < len(few) <= 80
    assert len(seen(rubble, most=26)) <= 26
    Scene(few)
    # Larger boxes cover what the smaller ones did.
    assert distance(np.vstack([corners(box) for box in many]), few).max() < 0.03


def test_no_depth_no_obstacles():
    depth = cast([object_box(), PALM])
    color = np.zeros((*depth.shape, 3), np.uint8)
    for empty in (
        None,
        np.zeros(depth.shape, np.float32),
        np.full(depth.shape, np.nan, np.float32),
    ):
        frame = RGBDFrame(color, empty, CAMERA)
        assert obstacles_from_depth(frame, T_BASE_CAMERA, T_BASE_OBJECT, BODY) == ()


def test_pixels_without_measurement_count_as_nothing():
    depth = cast([object_box(), PALM]).astype(np.float32)
    holes = np.random.default_rng(0).random(depth.shape)
    depth[holes < 0.1] = 0.0
    depth[holes > 0.9] = np.nan
    frame = frame_of(depth)
    obstacles = obstacles_from_depth(frame, T_BASE_CAMERA, T_BASE_OBJECT, BODY)
    size, T = PALM
    true = [Obstacle("palm", size, T)]
    assert obstacles
    assert all(distance(corners(box), true).max() < 0.08 for box in obstacles)


def test_noise_alone_is_no_obstacle():
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.4, 4.0, (CAMERA.height, CAMERA.width))
    assert obstacles_from_depth(frame_of(depth), T_BASE_CAMERA, T_BASE_OBJECT, BODY) == ()
    # And some in a frame of the object.
    depth = np.where(rng.random(depth.shape) < 0.05, depth, cast([object_box()]))
    assert obstacles_from_depth(frame_of(depth), T_BASE_CAMERA, T_BASE_OBJECT, BODY) == ()


def test_far_things_are_left_out():
    assert seen([POST], radius=0.25) == ()
    assert seen([POST], radius=0.5)


def test_the_robot_is_no_obstacle():
    robot = Robot.pr2()
    state = robot.home
    # Boxes as large as its palm and a forearm's piece, where those are.
    T_gripper = robot.T_base_gripper(state)
    T_base_camera = T_gripper * T_BASE_OBJECT.inv() * T_BASE_CAMERA
    depth = cast([((0.05, 0.11, 0.054), T_BASE_OBJECT * AT((-0.125, 0.0, 0.0)))])
    body = BoxBody((0.02, 0.02, 0.02), (0.15, 0.0, 0.0))
    frame = frame_of(depth)
    assert obstacles_from_depth(frame, T_base_camera, T_gripper, body)
    assert obstacles_from_depth(frame, T_base_camera, T_gripper, body, robot=robot) == ()
    # With the arm elsewhere they are something else again.
    q = robot.arm(state) + 0.5
    elsewhere = robot.with_arm(state, np.clip(q, robot.soft_lower, robot.soft_upper))
    assert obstacles_from_depth(frame, T_base_camera, T_gripper, body, robot=robot, state=elsewhere)


def test_what_holds_the_object_is_what_hangs_together_with_it():
    def box(name, x, size=0.1):
        return Obstacle(name, (size, size, size), T_BASE_OBJECT * AT((x, 0.0, 0.0)))

    # Gaps of 1 cm from one to the next, then one of 10 cm.
    hand, wrist, shelf = box("hand", 0.14), box("wrist", 0.25), box("shelf", 0.45)
    for order in ((hand, wrist, shelf), (shelf, wrist, hand)):
        assert set(holding(order, T_BASE_OBJECT, BODY)) == {"hand", "wrist"}
    assert holding((hand, wrist), T_BASE_OBJECT, BODY, gap=0.005) == ()
    assert holding((wrist, shelf), T_BASE_OBJECT, BODY) == ()
    assert holding((), T_BASE_OBJECT, BODY) == ()


def test_carried_obstacles_move_along():
    robot = Robot.pr2()
    T, q = robot.T_base_gripper(robot.home), robot.arm(robot.home)
    hand = Obstacle("hand", (0.05, 0.05, 0.05), T * AT((0.5, 0.0, 0.0)))
    wall = Obstacle("wall", (0.05, 0.05, 0.05), T * AT((0.6, 0.0, 0.0)))
    lying = ObjectBody((0.05, 0.05, 0.05), T * AT((0.3, 0.0, 0.0)))
    checker = CollisionChecker(robot, Scene((hand, wall), lying))
    assert checker.check(q) is None
    # By a rotation about the gripper and a shift onto its palm.
    turned = RigidTransform.from_rotation(Rotation.from_euler("z", 0.8))
    onto = T * AT((-0.1, 0.0, 0.0)) * turned * AT((-0.5, 0.0, 0.0)) * T.inv()
    checker.move_obstacles(["hand"], onto)
    assert checker.check(q).second == "hand"
    checker.move_obstacles(["hand"], T * AT((-0.3, 0.3, 0.0)) * T.inv())
    assert checker.check(q) is None
    checker.move_obstacles(["wall"], T * AT((-0.7, 0.0, 0.0)) * T.inv())
    assert checker.check(q).second == "wall"
    # An object of another size needs another model, in which they are where they were.
    checker.set_object(ObjectBody((0.04, 0.04, 0.04), T * AT((0.3, 0.0, 0.0))))
    assert checker.check(q).second == "wall"
    checker.move_obstacles((), onto)
    assert checker.check(q) is None
    with pytest.raises(InvalidInputError, match="no obstacle is called shelf; there are: hand"):
        checker.move_obstacles(["shelf"], onto)


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"radius": 0.0}, "radius must be > 0 m, got 0.0"),
        ({"cell": np.nan}, "cell must be > 0 m, got nan"),
        ({"most": 25}, "most must be ≥ 26 boxes, got 25"),
        ({"thickness": -0.01}, "thickness must be ≥ 0, got -0.01"),
        ({"margin": np.inf}, "margin must be ≥ 0, got inf"),
    ],
)
def test_figures_out_of_range_are_refused(config, message):
    with pytest.raises(InvalidInputError, match=message):
        ObstacleConfig(**config)
