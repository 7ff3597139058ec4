"""The second half of the demonstration: grasps are shown, and then done where objects stand now."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.demo.film import Film, write_storyboard
from planegrasp.demo.watching import wall, watched
from planegrasp.geometry import rotation_angle
from planegrasp.grasping.plan import GraspPlan
from planegrasp.library import ObjectLibrary
from planegrasp.robot.model import Robot
from planegrasp.simulation.experiment import KINECT, Experiment, Setting, facing
from planegrasp.simulation.objects import Thing, cracker_box, picture_book
from planegrasp.simulation.showing import hold_at, show_grasp
from planegrasp.teaching.teach import teach

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from planegrasp.geometry import RigidTransform
    from planegrasp.grasping.canonical import CanonicalGrasp
    from planegrasp.simulation.driver import SimulatedEyes
    from planegrasp.simulation.experiment import Kind
    from planegrasp.simulation.supports import Hold
    from planegrasp.simulation.trial import Trial
    from planegrasp.teaching.quality import TeachingQuality

__all__ = ["ACTS", "STAGES", "Act", "GraspDemo", "Performance", "ShownGrasp"]

STAGES = ("initial", "planned", "moved", "reached", "closed", "lifted", "held")
"""What an experiment goes through when all is well."""


@dataclass(frozen=True, slots=True)
class Act:
    """What is put before the robot.

    Attributes:
        name: of the recording.
        title: in words.
        kind: on a tripod, or held by a person.
        object: name of the thing.
        position: in the robot's base [m].
        tilt: of its face against the line of sight [°].
        axis: about which it is tilted, in the upright face [°].
        roll: about the face's normal [°].
        hold: where the person's hand holds it.
    """

    name: str
    title: str
    kind: Kind
    object: str
    position: tuple[float, float, float]
    tilt: float
    axis: float
    roll: float
    hold: Hold | None = None

    def setting(self, robot: Robot, things: Sequence[Thing], seed: int) -> Setting:
        """The experiment; the seed is that of all noise."""
        thing = next(thing for thing in things if thing.model.name == self.object)
        T_base_object = facing(
            np.array(self.position),
            robot.T_base_camera(robot.home).translation,
            tilt=math.radians(self.tilt),
            axis=math.radians(self.axis),
            roll=math.radians(self.roll),
        )
        return Setting(self.kind, thing, T_base_object, math.radians(self.tilt), self.hold, seed)


ACTS = (
    Act(
        "tripod",
        "A cracker box on a tripod, tilted by 45°",
        "static",
        "cracker-box",
        position=(0.65, -0.24, 0.88),
        tilt=45.0,
        axis=205.0,
        roll=-8.0,
    ),
    Act(
        "handheld",
        "A picture book in a person's hand, which moves",
        "handheld",
        "picture-book",
        position=(0.61, -0.05, 0.91),
        tilt=45.0,
        axis=290.0,
        roll=8.0,
        hold="left",
    ),
)
"""The demonstration's experiments. Of the grasps that are shown, the arm reaches only some."""


@dataclass(frozen=True, slots=True, eq=False)
class ShownGrasp:
    """A grasp that was shown once.

    Attributes:
        object: name.
        grasp: as it was learnt.
        position_error: of the gripper in the object, against what was meant to be shown [m].
        rotation_error: likewise [rad].
    """

    object: str
    grasp: CanonicalGrasp
    position_error: float
    rotation_error: float


@dataclass(frozen=True, slots=True, eq=False)
class Performance:
    """How an act went.

    Attributes:
        act: that was tried.
        trial: what happened.
        frames: in how many the robot looked for the object.
        found: in how many of them it found it.
        recording: the Rerun recording; None where rerun-sdk is not installed.
        T_camera_object: the true pose when the grasp was planned; None where none was.
    """

    act: Act
    trial: Trial
    frames: int
    found: int
    recording: Path | None
    T_camera_object: RigidTransform | None

    @property
    def plan(self) -> GraspPlan | None:
        """What was tried; None where nothing was."""
        return self.trial.plan if isinstance(self.trial.plan, GraspPlan) else None

    @property
    def tilt_deg(self) -> float | None:
        """Angle between its front's normal and the line of sight as it was seen [°]."""
        detection = self.trial.detection
        if detection is None or detection.T_camera_object is None:
            return None
        return _tilt_deg(detection.T_camera_object)

    @property
    def true_tilt_deg(self) -> float | None:
        """The same as it was [°]; None where nothing was planned."""
        return None if self.T_camera_object is None else _tilt_deg(self.T_camera_object)

    @property
    def position_sigma(self) -> float | None:
        """Largest standard deviation of the object's position when the grasp was planned [m]."""
        detection = self.trial.detection
        if detection is None or detection.covariance is None:
            return None
        return math.sqrt(float(np.linalg.eigvalsh(detection.covariance[:3, :3])[-1]))

    @property
    def faults(self) -> tuple[str, ...]:
        """What went wrong, in words."""
        trial, what = self.trial, f"the {self.act.object} ({self.act.name})"
        if trial.is_refusal:
            assert trial.plan is not None
            reasons = "; ".join(f"{name}: {why}" for name, why in trial.plan.reasons.items())
            return (f"{what} was not grasped: {reasons}",)
        return () if trial.is_success else (f"{what} was not grasped: {trial.cause}",)


@dataclass(slots=True)
class GraspDemo:
    """Teach two objects, show grasps of them, do them elsewhere, in one folder.

    Attributes:
        path: the folder.
        seed: of all noise.
        acts: what is done.
        sides: at which grasps are shown, see `simulation.showing`.
        things: what is taught; all that the acts need where empty.
    """

    path: Path
    seed: int = 0
    acts: tuple[Act, ...] = ACTS
    sides: tuple[str, ...] = ("side", "top", "left")
    things: tuple[Thing, ...] = ()

    def __post_init__(self) -> None:
        if not self.things:
            needed = {act.object for act in self.acts}
            known = (cracker_box(), picture_book())
            self.things = tuple(thing for thing in known if thing.model.name in needed)

    @property
    def library_path(self) -> Path:
        """Where the objects with their grasps are kept."""
        return self.path / "objects"

    def teach(self) -> dict[str, dict[str, TeachingQuality]]:
        """Teach the objects; the verdict on each face by object and face.

        Raises:
            LibraryError: the folder has a library that cannot be read, or cannot be written.
        """
        library = ObjectLibrary(self.library_path)
        models = [thing.model for thing in self.things]
        return {model.name: teach(library, model, replace=True) for model in models}

    def experiment(self) -> Experiment:
        """The robot, and a detector of what was taught; learning takes seconds a face."""
        library = ObjectLibrary(self.library_path)
        self.things = tuple(replace(t, model=library[t.model.name]) for t in self.things)
        return Experiment(Robot.pr2(), self.things, backgrounds=(wall(KINECT),))

    def show(self, experiment: Experiment, advance: Callable[[], None]) -> tuple[ShownGrasp, ...]:
        """Show grasps to the robot and keep them with the objects; `advance` after each.

        Raises:
            TeachingError: the arm does not reach an object, or the camera does not see it.
        """
        shown = []
        library = ObjectLibrary(self.library_path)
        for thing in experiment.things:
            model = thing.model
            model.grasps.clear()
            for side in self.sides:
                seen = show_grasp(experiment.robot, thing, experiment.detector, side)
                grasp = seen.grasp(side)
                meant = hold_at(model.outer_body, side)
                off = grasp.T_object_gripper.translation - meant.translation
                angle = rotation_angle(grasp.T_object_gripper.rotation, meant.rotation)
                model.grasps.append(grasp)
                shown.append(ShownGrasp(model.name, grasp, float(np.linalg.norm(off)), angle))
                advance()
            library[model.name].grasps[:] = model.grasps
        library.save()
        return tuple(shown)

    def perform(
        self, experiment: Experiment, act: Act, advance: Callable[[str], None]
    ) -> tuple[Performance, Film]:
        """Do one act; `advance` is called at each stage with its name.

        Returns:
            How it went, and the pictures of it.
        """
        setting = act.setting(experiment.robot, experiment.things, self.seed)
        world = watched(experiment, setting)
        with Film(world, self.path / f"{act.name}.rrd") as film:

            def notice(stage: str, arm: object, eyes: SimulatedEyes) -> None:
                film.take(stage, eyes)
                advance(stage)

            trial = experiment.run(setting, world, show=notice)
            film.finish(trial)
        performance = Performance(
            act, trial, film.frames, film.found, film.recording, film.T_camera_object
        )
        return performance, film

    def write_storyboard(self, acts: Sequence[tuple[Performance, Film]]) -> Path:
        """Lay out the pictures of all acts, like the figures of the paper."""
        path = self.path / "grasp.png"
        write_storyboard(path, [(p.act.title, film) for p, film in acts])
        return path


def _tilt_deg(T_camera_object: RigidTransform) -> float:
    translation, rotation = T_camera_object.as_components()
    cosine = -rotation.as_matrix()[:, 2] @ translation / np.linalg.norm(translation)
    return math.degrees(math.acos(float(np.clip(cosine, -1.0, 1.0))))
