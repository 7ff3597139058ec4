"""The judge of grasps, and what the benchmark makes of its verdicts."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planegrasp.bench.grasp import GraspSettings, Outcome, summary
from planegrasp.bench.pr2_arm import forward
from planegrasp.bench.reachability import Judge
from planegrasp.body import BoxBody
from planegrasp.geometry import RigidTransform, rotation_angle
from planegrasp.grasping.canonical import CanonicalGrasp
from planegrasp.objects import ObjectModel
from planegrasp.robot import Robot
from planegrasp.simulation.experiment import facing
from planegrasp.simulation.showing import hold_at
from planegrasp.simulation.supports import Hand
from planegrasp.simulation.world import World

BOX = BoxBody((0.158, 0.210, 0.060))
GRASP = CanonicalGrasp("side", hold_at(BOX, "side"), opening=0.085)


@pytest.fixture(scope="module")
def robot():
    return Robot.pr2()


def judged(robot, position, grasps=(GRASP,), support=None):
    eye = robot.T_base_camera(robot.home).translation
    T = facing(np.array(position), eye)
    image = np.full((210, 158, 3), 127, np.uint8)
    model = ObjectModel.box("box", BOX.size, {"front": image})
    world = World(robot, model, T, support)
    return Judge(world).verdict(grasps, T, robot.home)


def test_the_closed_form_is_that_of_the_model(robot):
    rng = np.random.default_rng(5)
    torso = robot.joint(robot.home, "torso_lift")
    for _ in range(20):
        q = rng.uniform(np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi))
        modelled = robot.T_base_gripper(robot.with_arm(robot.home, q))
        closed = forward(q, torso)
        assert np.abs(modelled.translation - closed.translation).max() < 1e-9
        assert rotation_angle(modelled.rotation, closed.rotation) < 1e-7


def test_verdicts(robot):
    assert judged(robot, (0.62, -0.12, 0.85)) == "reachable"
    assert judged(robot, (1.15, -0.12, 0.85)) == "unreachable"
    # A gripper that opens less than the grasp needs is none that could hold it.
    wide = replace(GRASP, opening=0.095)
    assert judged(robot, (0.62, -0.12, 0.85), (wide,)) == "unreachable"
    assert judged(robot, (0.62, -0.12, 0.85), (wide, GRASP)) == "reachable"


def test_a_hand_in_the_way_blocks_a_grasp(robot):
    place = (0.62, -0.12, 0.85)
    assert judged(robot, place, support=Hand("left")) == "reachable"
    assert judged(robot, place, support=Hand("right")) == "blocked"


def test_a_palm_in_the_object_blocks_a_grasp(robot):
    deep = replace(
        GRASP,
        T_object_gripper=GRASP.T_object_gripper * RigidTransform.from_translation([0.08, 0, 0]),
    )
    assert judged(robot, (0.62, -0.12, 0.85), (deep,)) == "blocked"


def outcome(verdict, result, kind="static", **changes):
    made = Outcome(
        kind, 1, "box", 10.0, verdict, result, "", "side", 1.0, 0.1, 0.2, 3.0, collisions=()
    )
    return replace(made, **changes)


def test_figures_count_what_they_say():
    outcomes = [
        *[outcome("reachable", "success")] * 3,
        outcome("reachable", "refused", reason="side: in collision: x; top: unreachable: 1 m"),
        outcome("reachable", "failed", reason="missed", collisions=("arm touches pole",)),
        outcome("blocked", "refused", reason="side: no straight way to it: y"),
        outcome("unreachable", "refused", gripper_mm=math.nan, reason="side: unreachable: 2 m"),
        outcome("unreachable", "success"),
        outcome("reachable", "success", "handheld", gripper_mm=5.0, plan_seconds=1.0),
    ]
    result = summary(0, GraspSettings(), outcomes)
    figures = result.figures
    assert figures["static.success"] == pytest.approx(3 / 5)
    assert figures["handheld.success"] == 1.0
    assert figures["unreachable.refused"] == 0.5
    assert figures["robot_collisions"] == 1
    assert figures["gripper_mm_median"] == 1.0
    assert figures["plan_seconds_p99"] > 0.9
    rows = {(row["object"], row["truth"]): row for row in result.rows}
    assert rows["tripod", "reachable"]["poses"] == 5
    assert rows["tripod", "reachable"]["robot hit"] == 1
    notes = "\n".join(result.notes)
    assert "unreachable, yet success" in notes
    assert "arm touches pole" in notes
    assert "unreachable 2, in collision 1, no straight way 1" in notes


def test_nothing_measured_has_no_figures():
    figures = summary(0, GraspSettings(), []).figures
    assert math.isnan(figures["static.success"])
    assert figures["robot_collisions"] == 0
