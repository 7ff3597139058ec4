"""Whole trials with the PR2, which sees rendered frames only: judged by the simulation's truth."""

import numpy as np
import pytest
from worlds import CAMERA

from planegrasp.geometry import PinholeCamera, RigidTransform
from planegrasp.grasping.executor import GraspExecutor
from planegrasp.grasping.planner import GraspPlanner
from planegrasp.robot.scene import Scene
from planegrasp.simulation.driver import DriverConfig, SimulatedArm, SimulatedEyes
from planegrasp.simulation.experiment import Setting, facing
from planegrasp.simulation.hand_motion import HandMotion
from planegrasp.simulation.supports import Hand
from planegrasp.simulation.trial import TrialConfig, run_trial
from planegrasp.simulation.world import World, WorldConfig

# The hand-held box is looked at again and again: with half of the Kinect's resolution.
SMALL = PinholeCamera(320, 240, 262.5, 262.5, 159.5, 119.5)


def before(pr2, position, **turned):
    return facing(np.array(position), pr2.T_base_camera(pr2.home).translation, **turned)


def check_success(trial):
    assert trial.is_success, trial
    assert not trial.is_refusal
    assert trial.held
    assert trial.execution.outcome == "held"
    assert trial.lifted > 0.1
    assert trial.slip < 0.02
    assert trial.collisions == {}
    distance, angle = trial.gripper_error
    assert 0 < distance <= 0.002
    assert 0 < angle <= np.radians(0.5)


def test_the_pr2_takes_a_box_from_a_tripod(pr2, carton_thing, experiment):
    T = before(pr2, [0.62, -0.12, 0.9], tilt=0.4, axis=1.0)
    setting = Setting("static", carton_thing, T, 0.4, None, seed=3)
    stages = []
    world = experiment.world(setting)
    trial = experiment.run(setting, world, show=lambda stage, arm, eyes: stages.append(stage))
    check_success(trial)
    assert stages == ["initial", "planned", "moved", "reached", "closed", "lifted", "held"]
    assert trial.plan.name == trial.detection.name == "cracker-box"
    # It is still there, in the fingers, as far above the floor as the trial says.
    assert world.grip().closed
    assert world.T_base_object.translation[2] - T.translation[2] == pytest.approx(
        trial.lifted, abs=0.005
    )


def test_the_pr2_takes_a_box_out_of_a_hand(pr2, carton_thing, experiment):
    T = before(pr2, [0.62, -0.12, 0.9], tilt=0.2)
    world = World(pr2, carton_thing.model, T, Hand("left"), WorldConfig(mass=carton_thing.mass))
    rng = np.random.default_rng(1)
    driver = DriverConfig(frame_rate=5.0)
    eyes = SimulatedEyes(world, world.camera(CAMERA), experiment.detector, rng, config=driver)
    arm = SimulatedArm(world, motion=HandMotion(T, rng), eyes=eyes, config=driver)
    trial = run_trial(
        arm,
        eyes,
        experiment.planner,
        experiment.executor,
        lambda T_base_object: (Scene(), ()),
        moving=True,
        config=TrialConfig(hold=1.0),
    )
    check_success(trial)
    # The hand moved while the arm came: what was planned is not where it was taken.
    taken = arm.released_at.translation - trial.plan.T_base_object.translation
    assert np.linalg.norm(taken) > 0.01
    assert eyes.frames > 10


def test_what_is_out_of_reach_is_refused_and_nothing_moves(pr2, carton_thing, experiment):
    T = before(pr2, [1.1, 0.0, 1.0])
    setting = Setting("static", carton_thing, T, 0.0, None, seed=0)
    world = experiment.world(setting)
    stages = []
    trial = experiment.run(setting, world, show=lambda stage, arm, eyes: stages.append(stage))
    assert trial.is_refusal
    assert not trial.is_success
    assert trial.execution is None
    assert trial.cause == ""
    assert trial.collisions == {}
    assert set(trial.plan.reasons) == {"side", "top"}
    for reason in trial.plan.reasons.values():
        assert "outside the workspace" in reason
    assert stages == ["initial"]
    # The head has turned; arm and gripper stand where they stood.
    home = pr2.home
    np.testing.assert_allclose(pr2.arm(world.robot_state), pr2.arm(home), atol=1e-3)
    assert pr2.opening(world.robot_state) == pytest.approx(pr2.opening(home), abs=1e-3)


def test_what_is_behind_the_robot_is_not_found(pr2, carton_thing, experiment):
    T = RigidTransform.from_translation([-1.5, 0.0, 1.0])
    setting = Setting("static", carton_thing, T, 0.0, None, seed=0)
    trial = experiment.run(setting, config=TrialConfig(places=((0.7, 0.0, 0.9),), turning=0.1))
    assert trial.cause == "not found"
    assert (trial.detection, trial.plan, trial.execution) == (None, None, None)
    assert not trial.is_success
    assert not trial.is_refusal


def test_a_robot_without_head_looks_where_its_camera_looks(gripper, carton_thing, experiment):
    eye = gripper.T_base_camera(gripper.home).translation
    T = facing(np.array([0.9, 0.0, eye[2]]), eye)
    world = World(gripper, carton_thing.model, T)
    eyes = SimulatedEyes(world, world.camera(CAMERA), experiment.detector, np.random.default_rng(0))
    trial = run_trial(
        SimulatedArm(world),
        eyes,
        GraspPlanner(gripper),
        GraspExecutor(gripper),
        lambda T_base_object: (Scene(), ()),
    )
    assert trial.detection is not None
    assert eyes.frames == 1
    # It only goes up and down.
    assert trial.is_refusal
    assert all("unreachable" in reason for reason in trial.plan.reasons.values())


def test_a_head_that_cannot_turn_to_a_place_looks_at_the_others(pr2, carton_thing, experiment):
    T = before(pr2, [1.35, 0.0, 1.0])
    setting = Setting("static", carton_thing, T, 0.0, None, seed=0)
    behind, there = (-0.5, 0.0, 0.2), (1.35, 0.0, 1.0)
    trial = experiment.run(setting, config=TrialConfig(places=(behind, there), turning=0.4))
    assert trial.detection is not None
