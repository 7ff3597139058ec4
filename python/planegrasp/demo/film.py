"""Pictures and a recording of an experiment: by the robot's camera, and from outside."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.closing import ClosesAtEnd
from planegrasp.demo.watching import onlooker_view, wall
from planegrasp.grasping.plan import GraspPlan
from planegrasp.io.atomic import write_atomically
from planegrasp.simulation.experiment import KINECT
from planegrasp.simulation.raycast_values import RaycastConfig
from planegrasp.viz.gripper import draw_gripper
from planegrasp.viz.overlay import draw_detections
from planegrasp.viz.palette import object_colors
from planegrasp.viz.storyboard import storyboard

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from planegrasp.demo.watching import WatchedWorld
    from planegrasp.detection import Detection
    from planegrasp.geometry import RigidTransform
    from planegrasp.simulation.driver import SimulatedEyes
    from planegrasp.simulation.raycast_values import RaycastRendering
    from planegrasp.simulation.trial import Trial

    Image = NDArray[np.uint8]

__all__ = ["COLUMNS", "Film", "write_storyboard"]

COLUMNS = {"initial": "initial", "planned": "adapting", "closed": "grasped", "held": "lifted"}
"""Stages of which there are pictures, and what they are called."""
_PLANNED, _FOUND = object_colors(("planned", "found")).values()
_SHADE = 4  # grey levels between the shades of the storyboard
# Of the robot's pictures the half nearer to the object is shown: width and height [px].
_WINDOW = (512, 320)
_VIEWS = ("the robot's camera", "from outside")


@dataclass(frozen=True, slots=True, eq=False)
class _Take:
    """What both cameras see at one time."""

    robot: RaycastRendering
    onlooker: RaycastRendering
    object: NDArray[np.float64]  # the pixel (2) of its origin in the robot's picture
    found: Detection | None


class Film(ClosesAtEnd):
    """Takes pictures of a world at stages, and records it in between; a context manager.

    Attributes:
        recording: the Rerun recording; None where rerun-sdk is not installed.
        frames: in how many the robot looked for the object.
        found: in how many of them it found it.
        T_camera_object: the true pose when the grasp was planned; None before.
    """

    def __init__(self, world: WatchedWorld, recording: Path) -> None:
        """Begin with a world at its beginning; `recording` is replaced."""
        self._world = world
        quiet = RaycastConfig(color_noise=0.0)
        self._robot, self._onlooker = world.camera(KINECT, config=quiet), onlooker_view(world)
        self._takes: dict[str, _Take] = {}
        self._eyes: SimulatedEyes | None = None
        self._seen: object = None
        self._plan: GraspPlan | None = None
        self._planned_at = 0.0
        self.T_camera_object: RigidTransform | None = None
        self._stack = ExitStack()
        self.recording = recording if find_spec("rerun") is not None else None
        self._rerun = None
        self.frames = self.found = 0
        if self.recording is not None:
            from planegrasp.viz.rerun_robot import RobotRecording

            self._rerun = self._stack.enter_context(RobotRecording(self.recording, world))
        world.watch = self._record

    def take(self, stage: str, eyes: SimulatedEyes) -> None:
        """Take the stage's pictures if it is one of `COLUMNS`."""
        self._eyes = eyes
        T_camera_object = self._world.T_base_camera.inv() * self._world.T_base_object
        if self._rerun is not None:
            self._rerun.note(stage)
        if stage == "planned":
            self._planned_at = self._world.time
            self.T_camera_object = T_camera_object
        if stage in COLUMNS:
            rng, data = np.random.default_rng(0), self._world.data
            self._takes[stage] = _Take(
                self._robot.render(data, rng, background=wall(KINECT)),
                self._onlooker.render(data, rng, background=wall()),
                KINECT.project(T_camera_object.translation[None])[0],
                eyes.last[1] if eyes.last is not None and stage == "planned" else None,
            )
        self._record()

    def finish(self, trial: Trial) -> None:
        """Add what was planned, which is known only now."""
        if self._eyes is not None:
            self.frames, self.found = self._eyes.frames, self._eyes.found
        self._plan = plan = trial.plan if isinstance(trial.plan, GraspPlan) else None
        if self._rerun is None or plan is None:
            return
        T_world_base = self._world.T_world_base
        robot, start = self._world.robot, self._world.robot.home
        ways = (plan.move, plan.reach, plan.lift)
        states = (robot.with_arm(start, q) for way in ways for q in way.q)
        self._rerun.plan(
            self._planned_at,
            T_world_base * plan.T_base_pregrasp,
            T_world_base * plan.T_base_gripper,
            plan.opening,
            np.array([(T_world_base * robot.T_base_gripper(s)).translation for s in states]),
        )

    def pictures(self) -> tuple[list[Image], list[Image]]:
        """A row by the robot's camera and one by the onlooker; stages not reached are empty."""
        robot, onlooker = [], []
        for stage in COLUMNS:
            take = self._takes.get(stage)
            if take is None:
                robot.append(_nothing(self._robot.camera.height, self._robot.camera.width))
                onlooker.append(_nothing(self._onlooker.camera.height, self._onlooker.camera.width))
                continue
            robot.append(_around(self._drawn(take.robot, take.found), take.object))
            onlooker.append(take.onlooker.frame.color)
        return robot, onlooker

    def _drawn(self, rendering: RaycastRendering, found: Detection | None) -> Image:
        """A picture with what was found in it, and where the gripper is to go."""
        if found is None:
            return rendering.frame.color
        image = draw_detections(rendering.frame, [found], {found.name: _FOUND})
        if self._plan is not None:
            T_camera_base = rendering.T_world_camera.inv() * self._world.T_world_base
            T_camera_gripper = T_camera_base * self._plan.T_base_gripper
            draw_gripper(image, KINECT, T_camera_gripper, self._plan.opening, _PLANNED)
        return image

    def _record(self) -> None:
        """Record where everything is, and the newest frame."""
        if self._rerun is None:
            return
        self._rerun.state()
        last = None if self._eyes is None else self._eyes.last
        if last is not None and last[0] is not self._seen:
            self._seen = rendering = last[0]
            self._rerun.frame(rendering.frame, rendering.T_world_camera, last[1])

    def close(self) -> None:
        """Finish what is being written."""
        self._world.watch = None
        self._stack.close()


def write_storyboard(path: Path, films: Sequence[tuple[str, Film]]) -> None:
    """Lay out the pictures of films with titles, and write them."""
    stories = [(title, film.pictures()) for title, film in films]
    board = storyboard(stories, tuple(COLUMNS.values()), _VIEWS)
    # Fewer shades and more time make the file a third as large.
    shades = np.minimum(board // _SHADE * _SHADE + _SHADE // 2, 255).astype(np.uint8)
    bgr = np.ascontiguousarray(shades[:, :, ::-1])
    encoded = cv2.imencode(".png", bgr, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1]
    write_atomically(path, encoded.tobytes())


def _around(image: Image, pixel: NDArray[np.float64]) -> Image:
    """A part of an image, half-way between its middle and a pixel (2)."""
    rows, columns = image.shape[:2]
    width, height = _WINDOW
    middle = (np.array([columns, rows]) / 2 + pixel) / 2
    left, top = np.clip(middle - np.array(_WINDOW) / 2, 0, (columns - width, rows - height))
    return image[round(top) : round(top) + height, round(left) : round(left) + width]


def _nothing(height: int, width: int) -> Image:
    return np.full((height, width, 3), 236, np.uint8)
