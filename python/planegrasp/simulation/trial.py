"""One experiment: the robot looks for an object, plans, grasps, lifts and holds it.

Perception works on rendered, noisy frames alone. The true poses of the simulation only judge.
"""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import RobotError
from planegrasp.geometry import rotation_angle
from planegrasp.grasping.plan import GraspRefusal

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

    from planegrasp.detection import Detection
    from planegrasp.geometry import RigidTransform
    from planegrasp.grasping.executor import Execution, GraspExecutor
    from planegrasp.grasping.plan import GraspPlan
    from planegrasp.grasping.planner import GraspPlanner
    from planegrasp.robot.scene import Scene
    from planegrasp.robot.state import RobotState
    from planegrasp.simulation.driver import SimulatedArm, SimulatedEyes

__all__ = ["Trial", "TrialConfig", "run_trial"]


@dataclass(frozen=True, slots=True)
class TrialConfig:
    """What counts as success, and where the robot looks.

    Attributes:
        places: points of the base frame at which the head looks until it sees the object [m];
            those that it cannot turn to are left out.
        turning: time for the head to turn [s].
        thinking: time that a moving object goes on moving while the motion is planned [s].
        hold: how long the object must be held [s].
        lifted: how high, at the end [m].
        slip: how far it may move in the gripper from the grip on [m].
    """

    places: tuple[tuple[float, float, float], ...] = (
        (0.70, -0.15, 0.90),
        (0.70, -0.55, 0.90),
        (0.70, 0.25, 0.90),
        (0.60, -0.15, 0.55),
        (0.60, -0.15, 1.25),
    )
    turning: float = 0.6
    thinking: float = 0.3
    hold: float = 2.0
    lifted: float = 0.1
    slip: float = 0.02


@dataclass(slots=True)
class Trial:
    """What happened.

    Attributes:
        detection: that was planned with, None where the object was not found.
        plan: or the refusal; None where the object was not found.
        plan_seconds: processor time of planning, which is done in one thread.
        state: of the robot when it planned, None where the object was not found.
        T_base_object: the true pose at that time, likewise.
        execution: None where nothing was attempted.
        gripper_error: of the adapted gripper pose against the ideal one: (distance [m], angle
            [rad]).
        lifted: by how much the object was higher after holding [m].
        slip: of the object in the gripper, from the grip to the end [m].
        held: whether both fingers pressed on it at the end.
        collisions: what the robot touched that it must not, in words with the time [s].
        cause: why it failed, in words; "" for a success or a refusal.
    """

    detection: Detection | None = None
    plan: GraspPlan | GraspRefusal | None = None
    plan_seconds: float = 0.0
    state: RobotState | None = None
    T_base_object: RigidTransform | None = None
    execution: Execution | None = None
    gripper_error: tuple[float, float] | None = None
    lifted: float = 0.0
    slip: float = 0.0
    held: bool = False
    collisions: dict[str, float] = field(default_factory=dict)
    cause: str = ""

    @property
    def is_success(self) -> bool:
        """Grasped, lifted and held, and nothing was touched that must not be."""
        return self.execution is not None and not self.cause

    @property
    def is_refusal(self) -> bool:
        """Nothing was attempted, for a reason."""
        return isinstance(self.plan, GraspRefusal)


def run_trial(
    arm: SimulatedArm,
    eyes: SimulatedEyes,
    planner: GraspPlanner,
    executor: GraspExecutor,
    scene_of: Callable[[RigidTransform], tuple[Scene, tuple[str, ...]]],
    *,
    moving: bool = False,
    config: TrialConfig | None = None,
    show: Callable[[str], None] | None = None,
) -> Trial:
    """Do one experiment.

    Args:
        arm: of a world in which something holds the object.
        eyes: of the same world.
        planner: for its robot.
        executor: likewise.
        scene_of: what the planner is told of the surroundings for an estimated T_base_object:
            obstacles, and the names of those that hold the object. It is asked right after the
            frame was taken. What holds a moving object moves along with it.
        moving: whether the object moves, and is to be followed.
        config: what counts.
        show: called at each stage with its name, to take pictures.
    """
    config = config or TrialConfig()
    show = show or (lambda stage: None)
    world, trial = arm.world, Trial(collisions=arm.collisions)
    show("initial")
    detection = trial.detection = _find(arm, eyes, config)
    if detection is None or detection.T_camera_object is None:
        trial.cause = "not found"
        return trial
    T_base_object = world.T_base_camera * detection.T_camera_object
    sighting = eyes.sight(detection)
    scene, supports = scene_of(T_base_object)
    trial.state, trial.T_base_object = arm.state, world.T_base_object
    begun = time.thread_time()
    plan = trial.plan = planner.plan(
        detection,
        world.T_base_camera,
        scene=scene,
        start=arm.state,
        supports=supports,
        leaving=supports if moving else (),
    )
    trial.plan_seconds = time.thread_time() - begun
    if isinstance(plan, GraspRefusal):
        return trial
    ideal = plan.grasp.adapt(world.T_base_object)
    trial.gripper_error = (
        float(np.linalg.norm(plan.T_base_gripper.translation - ideal.translation)),
        rotation_angle(plan.T_base_gripper.rotation, ideal.rotation),
    )
    show("planned")
    if moving:
        arm.advance(config.thinking)
    execution = trial.execution = executor.run(
        plan,
        arm,
        world.object_model.outer_body,
        scene=scene,
        carried=supports if moving else (),
        eyes=eyes if moving else None,
        sighting=sighting,
        notify=show,
    )
    if execution.is_held:
        _hold(arm, trial, config)
        show("held")
    else:
        trial.cause = f"{execution.outcome}: {execution.reason}"
    return trial


def _find(arm: SimulatedArm, eyes: SimulatedEyes, config: TrialConfig) -> Detection | None:
    """Look around until the object is seen, then at it; a robot without head just looks."""
    if not arm.world.robot.head_joints:
        return _with_pose(eyes.detect())
    for place in config.places:
        _look_at(place, arm, config)
        detection = _with_pose(eyes.detect())
        if detection is None or detection.T_camera_object is None:
            continue
        _look_at((arm.world.T_base_camera * detection.T_camera_object).translation, arm, config)
        centred = _with_pose(eyes.detect())
        if centred is not None:
            return centred
    return None


def _with_pose(detection: Detection | None) -> Detection | None:
    return None if detection is None or detection.T_camera_object is None else detection


def _look_at(point: ArrayLike, arm: SimulatedArm, config: TrialConfig) -> None:
    """Turn the head there, as long as it takes; not at all where it cannot."""
    with suppress(RobotError):
        arm.turn_head(arm.world.robot.look_at(point, arm.state))
    arm.advance(config.turning)


def _hold(arm: SimulatedArm, trial: Trial, config: TrialConfig) -> None:
    """Hold the lifted object, and judge by its true pose."""
    world = arm.world
    gripped, released = arm.gripped_at, arm.released_at
    if gripped is None or released is None:
        trial.cause = "lifted before its support let go"
        return
    arm.advance(config.hold)
    at_end = world.T_base_gripper.inv() * world.T_base_object
    trial.lifted = float(world.T_base_object.translation[2] - released.translation[2])
    trial.slip = float(np.linalg.norm(at_end.translation - gripped.translation))
    trial.held = arm.is_gripping
    if not trial.held:
        trial.cause = "slipped out of the fingers while it was held"
    elif trial.lifted < config.lifted:
        trial.cause = f"lifted by {1000 * trial.lifted:.0f} mm only"
    elif trial.slip > config.slip:
        trial.cause = f"slipped by {1000 * trial.slip:.0f} mm"
    elif trial.collisions:
        trial.cause = f"held, but {', '.join(trial.collisions)}"
