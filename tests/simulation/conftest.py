"""Robots and an object for the simulated world."""

from dataclasses import replace
from pathlib import Path

import pytest

from planegrasp.detector import DetectorConfig
from planegrasp.features.pruning import PruningConfig
from planegrasp.grasping import CanonicalGrasp
from planegrasp.robot import Robot
from planegrasp.simulation.experiment import Experiment
from planegrasp.simulation.objects import cracker_box
from planegrasp.simulation.showing import hold_at


@pytest.fixture(scope="session")
def gripper():
    return Robot.from_file(
        Path(__file__).parent / "gripper.xml",
        gripper_frame="tool",
        base_frame="base",
        finger_joints=("left", "right"),
        camera_frame="eye",
        home="home",
    )


@pytest.fixture(scope="session")
def pr2():
    return Robot.pr2()


@pytest.fixture(scope="session")
def carton_thing():
    """With a grasp at its side and one from above."""
    thing = cracker_box()
    sides = ("side", "top")
    grasps = [CanonicalGrasp(side, hold_at(thing.model.outer_body, side), 0.085) for side in sides]
    return replace(thing, model=replace(thing.model, grasps=grasps))


@pytest.fixture(scope="session")
def box(carton_thing):
    return carton_thing.model


@pytest.fixture(scope="session")
def experiment(pr2, carton_thing):
    """With a detector that knows the box as well as a quarter of the trial views can make it."""
    config = DetectorConfig(pruning=PruningConfig(views=40))
    return Experiment(pr2, [carton_thing], detector_config=config)


@pytest.fixture(scope="session")
def carton_detector(experiment):
    return experiment.detector
