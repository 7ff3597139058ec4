"""`planegrasp grasp teach --simulate` and `grasp plan`: what needs a robot."""

import json
import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.grasping import CanonicalGrasp
from planegrasp.io.camera_file import write_camera
from planegrasp.io.images import write_color, write_depth
from planegrasp.library import ObjectLibrary
from planegrasp.robot import Robot
from planegrasp.simulation.experiment import KINECT
from planegrasp.simulation.objects import cracker_box
from planegrasp.simulation.showing import hold_at
from planegrasp.simulation.world import World

# The box upright before the PR2, its front to the robot, its right at the robot's right.
T_BASE_OBJECT = RigidTransform.from_components(
    [0.62, -0.2, 0.85], Rotation.from_matrix([[0, 0, -1], [-1, 0, 0], [0, 1, 0]])
)


@pytest.fixture
def run(run):
    return partial(run, "grasp")


@pytest.fixture(autouse=True)
def library(tmp_path):
    made = ObjectLibrary(tmp_path / "objects")
    box = cracker_box().model
    made.add(replace(box, faces=(box.face("front"),)))
    made.save()
    return made


@pytest.fixture
def taught(library):
    """The box with a grasp at its right and one from below."""
    model = library["cracker-box"]
    for side in ("side", "bottom"):
        grasp = CanonicalGrasp(side, hold_at(model.outer_body, side), opening=0.085)
        model.grasps.append(grasp)
    library.save()
    return model


def write_pose(path, **poses):
    path.write_text(json.dumps({name: T.as_matrix().tolist() for name, T in poses.items()}))
    return path


def test_a_grasp_that_is_shown_in_simulation(run, library):
    arguments = ("teach", "cracker-box", "edge", "--simulate", "--side", "left", "--force", 30)
    code, out, err = run(*arguments, "--symmetric", "gripper", "--json")
    assert code == 0, err
    rows = json.loads(out)["grasps"]
    assert [row["name"] for row in rows] == ["edge", "edge/flipped"]
    stored = ObjectLibrary("objects")["cracker-box"].grasps
    assert [grasp.name for grasp in stored] == ["edge", "edge/flipped"]
    assert stored[0].force == 30
    assert stored[0].opening == pytest.approx(0.95 * 0.09)
    # As far off as the detector is in this frame: seen, not known.
    meant = hold_at(library["cracker-box"].outer_body, "left")
    off = np.linalg.norm(stored[0].T_object_gripper.translation - meant.translation)
    assert 1e-7 < off < 2e-3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--simulate", "--side", "back"], "side, top, left, bottom, not 'back'"),
        (["--simulate", "--poses", "shown.toml"], "--poses FILE .* or --simulate"),
        ([], "--poses FILE .* or --simulate"),
        (["--simulate", "--gripper-frame", "tool"], "--gripper-frame is for a robot from a file"),
        (["--simulate", "--robot", "arm.xml"], "A robot from a file needs --gripper-frame"),
        (
            ["--simulate", "--robot", "arm.xml", "--gripper-frame", "tool"],
            "A robot from a file needs --finger-joints",
        ),
        (
            [
                *("--simulate", "--robot", "arm.xml", "--gripper-frame", "tool"),
                *("--finger-joints", "left,right"),
            ],
            "arm.xml",
        ),
        (["--simulate", "--opening", "0.05"], "does not fit|60.* mm"),
    ],
)
def test_what_cannot_be_shown(run, arguments, message):
    code, _, err = run("teach", "cracker-box", "edge", *arguments)
    assert code == 1
    assert re.search(message, " ".join(err.split())), err
    assert not ObjectLibrary("objects")["cracker-box"].grasps


def test_a_robot_of_a_file(run):
    """The PR2 read from its own file is the PR2."""
    options = (
        *("--robot", Robot.pr2().path, "--base-frame", "base_link"),
        *("--gripper-frame", "r_gripper_tool_frame", "--exclude-joints", "torso_lift"),
        *("--finger-joints", "r_gripper_l_finger,r_gripper_r_finger"),
        *("--camera-frame", "kinect_optical", "--home", "ready"),
    )
    code, _, err = run("teach", "cracker-box", "edge", "--simulate", *options)
    assert code == 0, err
    code, _, err = run("teach", "cracker-box", "same", "--simulate")
    assert code == 0, err
    edge, same = ObjectLibrary("objects")["cracker-box"].grasps
    np.testing.assert_allclose(
        edge.T_object_gripper.as_matrix(), same.T_object_gripper.as_matrix(), atol=1e-6
    )


@pytest.mark.usefixtures("taught")
def test_a_plan_for_a_known_pose(run, tmp_path):
    pose = write_pose(tmp_path / "now.json", T_base_object=T_BASE_OBJECT)
    code, out, err = run("plan", "cracker-box", "--pose", pose)
    assert code == 0, err
    assert "cracker-box by grasp 'side'" in out
    assert "gripper at 0.620, -0.2" in out
    code, out, _ = run("plan", "cracker-box", "--pose", pose, "--json")
    plan = json.loads(out)
    assert not plan["refused"]
    expected = T_BASE_OBJECT.apply([cracker_box().model.outer_body.size[0] / 2 - 0.03, 0, 0])
    np.testing.assert_allclose(plan["T_base_gripper"]["translation"], expected, atol=1e-9)
    # The way ends where the gripper grasps: seven joints, checked by forward kinematics.
    robot = Robot.pr2()
    assert plan["joints"] == list(robot.arm_joints)
    at_end = robot.T_base_gripper(robot.with_arm(robot.home, plan["reach"][-1]))
    np.testing.assert_allclose(at_end.translation, expected, atol=1e-3)
    np.testing.assert_allclose(plan["move"][-1], plan["reach"][0], atol=1e-9)


@pytest.mark.usefixtures("taught")
def test_a_refusal_has_reasons_and_an_exit_code(run, tmp_path):
    far = RigidTransform.from_translation([1.0, 0.0, 0.0]) * T_BASE_OBJECT
    pose = write_pose(tmp_path / "far.json", T_base_object=far)
    code, out, _ = run("plan", "cracker-box", "--pose", pose)
    assert code == 1
    assert "cannot be grasped: none of 2 grasps can be done" in out
    assert out.count("unreachable") == 2
    code, out, _ = run("plan", "cracker-box", "--pose", pose, "--json")
    assert code == 1
    refusal = json.loads(out)
    assert refusal["refused"]
    assert {a["grasp"] for a in refusal["assessments"]} == {"side", "bottom"}
    assert all("unreachable" in a["reason"] for a in refusal["assessments"])


def test_a_plan_by_an_image(run, taught, tmp_path):
    """What the PR2 sees at home; the pose of another camera gives another plan."""
    robot = Robot.pr2()
    state = robot.look_at(T_BASE_OBJECT.translation)
    world = World(robot, taught, T_BASE_OBJECT)
    world.reset(state)
    frame = world.camera(KINECT).render(world.data, np.random.default_rng(0)).frame
    write_color(tmp_path / "color.png", frame.color)
    write_depth(tmp_path / "depth.png", frame.depth)
    write_camera(tmp_path / "camera.json", KINECT, 0.001)
    here = write_pose(tmp_path / "here.json", T_base_camera=robot.T_base_camera(state))
    seen = ("--image", "color.png", "--depth", "depth.png", "--camera", "camera.json")
    code, out, err = run("plan", "cracker-box", *seen, "--pose", here, "--json")
    assert code == 0, (out, err)
    plan = json.loads(out)
    np.testing.assert_allclose(
        plan["T_base_object"]["translation"], T_BASE_OBJECT.translation, atol=2e-3
    )
    assert plan["assessments"][0]["figures"]["closing_sigma"] > 0
    # Without depth the pose is not good enough to grasp, and that is what it says.
    code, out, _ = run("plan", "cracker-box", *seen[:2], *seen[4:], "--pose", here)
    assert code == 1
    assert "depth" in out


@pytest.mark.usefixtures("taught")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "Give --pose FILE, or --image FILE"),
        (["--pose", "camera.json"], "does not say where the object is"),
        (["--pose", "object.json", "--depth", "depth.png"], "go with --image"),
        (["--image", "color.png", "--pose", "object.json"], "was not found|where the camera was"),
    ],
)
def test_what_cannot_be_planned(run, tmp_path, arguments, message):
    write_pose(tmp_path / "object.json", T_base_object=T_BASE_OBJECT)
    write_pose(tmp_path / "camera.json", T_base_camera=T_BASE_OBJECT)
    write_color(tmp_path / "color.png", np.full((120, 160, 3), 90, np.uint8))
    code, _, err = run("plan", "cracker-box", *arguments)
    assert code == 1
    assert re.search(message, " ".join(err.split())), err
