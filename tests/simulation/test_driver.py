"""The simulated robot's arm and eyes: what they touch, when they see, when the person lets go."""

import numpy as np
import pytest
from worlds import BEFORE_PR2, CAMERA, IN_GRIPPER

from planegrasp.geometry import RigidTransform
from planegrasp.robot import Kinematics
from planegrasp.simulation.driver import DriverConfig, SimulatedArm, SimulatedEyes
from planegrasp.simulation.hand_motion import HandMotion
from planegrasp.simulation.supports import SUPPORT, Hand, Tripod
from planegrasp.simulation.world import World

PERIOD = 0.02


def eyes_on(world, detector, **config):
    rng = np.random.default_rng(0)
    return SimulatedEyes(world, world.camera(CAMERA), detector, rng, config=DriverConfig(**config))


@pytest.fixture
def world(pr2, box):
    """The box on its tripod, the robot looks at it."""
    world = World(pr2, box, BEFORE_PR2)
    world.reset(pr2.look_at(BEFORE_PR2.translation))
    return world


def test_eyes_see_where_the_object_is(world, carton_detector):
    eyes = eyes_on(world, carton_detector)
    detection = eyes.detect()
    sighting = eyes.sight(detection)
    assert sighting.time == world.time
    off = sighting.T_base_object.translation - BEFORE_PR2.translation
    # What it may be off is what it says: within five sigma in every direction.
    assert np.linalg.norm(off) < 5 * np.sqrt(np.trace(detection.covariance[:3, :3]))
    assert sighting.covariance is detection.pose.noise_covariance
    assert (eyes.frames, eyes.found) == (1, 1)
    rendering, last = eyes.last
    assert last is detection
    assert rendering.frame.color.shape == (480, 640, 3)


def test_eyes_say_late_what_they_see_at_their_frame_rate(world, carton_detector):
    eyes = eyes_on(world, carton_detector, frame_rate=5.0, latency=0.1)
    arm = SimulatedArm(world, eyes=eyes)
    seen = []
    for _ in range(50):  # one second
        sighting = eyes.look()
        if sighting is not None:
            seen.append((world.time, sighting.time))
        arm.advance(PERIOD)
    assert eyes.frames == 5
    said, taken = np.array(seen).T
    assert np.diff(taken) == pytest.approx(0.2, abs=0.011)
    # Asked every period, looked at every 10 ms.
    assert np.all(said - taken >= 0.1 - 1e-9)
    assert np.all(said - taken < 0.1 + PERIOD + 0.011)


def test_nobody_looks_so_no_frame_is_taken(world, carton_detector):
    eyes = eyes_on(world, carton_detector)
    arm = SimulatedArm(world, eyes=eyes)
    arm.advance(0.5)
    assert eyes.frames == 0
    assert eyes.look() is None
    arm.advance(0.5)
    assert eyes.frames == 1  # one look, one frame


def test_eyes_that_look_away_see_nothing(world, carton_detector):
    world.reset(world.robot.look_at([0.5, 1.5, 1.0]))
    eyes = eyes_on(world, carton_detector)
    assert eyes.detect() is None
    eyes.look()
    eyes.watch()
    world.step(1.0)
    assert eyes.look() is None
    assert (eyes.frames, eyes.found) == (2, 0)


@pytest.mark.parametrize("seconds", [0.0005, 0.003, 0.021, 0.02, 0.5])
def test_time_goes_on_by_what_is_asked_for(pr2, box, seconds):
    arm = SimulatedArm(World(pr2, box, BEFORE_PR2))
    arm.advance(seconds)
    timestep = arm.world.model.opt.timestep
    assert arm.time > 0
    assert arm.time == pytest.approx(seconds, abs=timestep)


def test_the_arm_goes_where_it_is_told(pr2, box):
    arm = SimulatedArm(World(pr2, box, BEFORE_PR2))
    q = pr2.arm(pr2.home) + np.array([0.1, 0.1, 0.2, -0.1, 0.3, 0.1, 0.2])
    arm.move(q)
    arm.grip(0.04, 30.0)
    head = pr2.look_at([0.8, 0.2, 0.8])
    arm.turn_head(head)
    arm.advance(2.0)
    np.testing.assert_allclose(pr2.arm(arm.state), q, atol=0.01)
    assert pr2.opening(arm.state) == pytest.approx(0.04, abs=0.002)
    for name in pr2.head_joints:
        assert pr2.joint(arm.state, name) == pytest.approx(pr2.joint(head, name), abs=0.01)
    assert arm.collisions == {}
    assert not arm.is_gripping


def test_driving_into_the_tripod_is_noticed(pr2, box):
    # The pole stands 60 mm behind the box's back; the gripper shall go to where it is.
    T = RigidTransform.from_components([0.6, -0.3, 0.9], BEFORE_PR2.rotation)
    world = World(pr2, box, T, Tripod())
    pole = T.apply([0.0, 0.0, -0.06]) - np.array([0.0, 0.0, 0.25])
    # Palm forward, a little beyond it.
    goal = RigidTransform.from_translation(pole + np.array([0.05, 0.0, 0.0]))
    result = Kinematics(pr2).inverse(goal)
    assert result, result.reason
    arm = SimulatedArm(world)
    start = pr2.arm(pr2.home)
    for share in np.linspace(0.0, 1.0, 100):
        arm.move(start + share * (result.q - start))
        arm.advance(PERIOD)
    touched = [what for what in arm.collisions if "touches support:" in what]
    assert touched
    assert all(0.0 < arm.collisions[what] <= arm.time for what in touched)


@pytest.fixture
def gripping(pr2, box):
    """An arm whose open gripper is around the box that a hand holds at its left."""
    reaching = pr2.with_arm(pr2.home, [-0.3, 0.2, -0.5, -1.2, 0.3, -0.9, 0.4])
    T_gripper_object = RigidTransform.from_components([0.055, 0.0, 0.0], IN_GRIPPER.rotation)
    T_base_object = pr2.T_base_gripper(reaching) * T_gripper_object
    world = World(pr2, box, T_base_object, Hand("left", reach=0.03))
    world.reset(pr2.with_opening(reaching, 0.09))
    still = HandMotion(T_base_object, np.random.default_rng(0))
    return SimulatedArm(world, motion=still)


def test_the_person_lets_go_a_moment_after_the_grip_and_goes_away(gripping):
    arm, world = gripping, gripping.world
    before = world.data.body(SUPPORT).xpos.copy()
    arm.advance(0.1)
    assert not arm.is_gripping
    arm.grip(0.0, 40.0)
    gripped = None
    while not world.is_released:
        arm.advance(0.01)
        if gripped is None and arm.is_gripping:
            gripped = arm.time
        assert arm.time < 3.0
    assert arm.time - gripped == pytest.approx(DriverConfig().reaction, abs=0.025)
    assert arm.is_gripping
    T_gripper_object = world.T_base_gripper.inv() * world.T_base_object
    off = arm.gripped_at.translation - T_gripper_object.translation
    assert np.linalg.norm(off) < 1e-3
    assert np.linalg.norm(arm.released_at.translation - world.T_base_object.translation) < 1e-3
    arm.advance(1.5)
    gone = world.data.body(SUPPORT).xpos - before
    # 350 mm, to where the person's arm is: the object's left; it drifted a little before.
    left = world.T_base_object.rotation.apply([-1.0, 0.0, 0.0])
    assert gone @ left == pytest.approx(0.35, abs=0.08)
    assert arm.is_gripping
    assert not any("support" in what for what in arm.collisions)


def test_who_does_not_press_enough_does_not_grip(gripping):
    gripping.grip(0.0, 40.0)
    gripping.advance(0.2)
    assert gripping.is_gripping
    # A moment after more was asked for, the fingers press as before.
    gripping.grip(0.0, 200.0)
    assert not gripping.is_gripping
