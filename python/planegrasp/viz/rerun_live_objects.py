"""The objects of a live recording in space: faces, axes, velocities, grasps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from planegrasp.viz.gripper import gripper_lines
from planegrasp.viz.palette import color_of
from planegrasp.viz.rerun_parts import axes, closed, pose_of, rerun, textured

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planegrasp.objects import PlanarFace
    from planegrasp.tracking import Track
    from planegrasp.viz.palette import RGB
    from planegrasp.viz.rerun_live import LiveRecordingConfig

    Path = tuple[str, ...]

# An arrow shows the way in so much time [s].
_AHEAD = 0.5
# Something that moves with at least this probability has an arrow.
_MOVES = 0.5


class Log(Protocol):
    """Logs something at an entity's path."""

    def __call__(self, path: Path, what: Any, *, static: bool = False) -> None:
        """Log it; static is what does not change over time."""


class ObjectEntities:
    """Logs objects that are seen, and clears those that are not.

    What an object looks like is logged when it appears, then only its pose.
    """

    def __init__(
        self, log: Log, colors: Mapping[str, RGB] | None, config: LiveRecordingConfig
    ) -> None:
        self._rr = rerun()
        self._log = log
        self._colors = colors
        self._config = config
        self._shown: set[Path] = set()
        self._arrows: set[Path] = set()
        self._textured: set[Path] = set()

    def write(self, tracks: Iterable[Track]) -> None:
        """Log where the objects are now."""
        shown: set[Path] = set()
        arrows: set[Path] = set()
        for track in tracks:
            if track.detection is None:
                continue
            which = (track.name, str(track.instance))
            root = ("world", "objects", *which)
            shown.add(root)
            self._log(root, pose_of(self._rr, track.filtered.T_base_object))
            if root not in self._shown:
                self._log_look(root, track)
            if track.moves >= _MOVES:
                arrow = ("world", "velocities", *which)
                arrows.add(arrow)
                self._log_arrow(arrow, track)
        for gone in (self._shown - shown) | (self._arrows - arrows):
            self._log(gone, self._rr.Clear(recursive=True))
        self._shown, self._arrows = shown, arrows

    def _log_look(self, root: Path, track: Track) -> None:
        rr, model = self._rr, track.model
        color = color_of(track.name, self._colors)
        size = min(min(face.width, face.height) for face in model.faces)
        self._log((*root, "axes"), axes(rr, size / 2))
        for face in model.faces:
            self._log_face((*root, "faces", face.name), face, color)
        if model.body is not None:
            box = rr.Boxes3D(
                sizes=[model.body.size], centers=[model.body.centre], colors=[color], radii=0.001
            )
            self._log((*root, "body"), box)
        if self._config.grasps:
            for grasp in model.grasps:
                path = (*root, "grasps", *grasp.name.split("/"))
                lines = gripper_lines(grasp.opening)
                self._log(path, pose_of(rr, grasp.T_object_gripper))
                self._log(path, rr.LineStrips3D(lines, colors=[color], radii=0.002))

    def _log_face(self, path: Path, face: PlanarFace, color: RGB) -> None:
        """A face with its picture, which is stored once."""
        rr, corners = self._rr, face.object_corners
        outline = rr.LineStrips3D([closed(corners)], colors=[color], radii=face.width / 100)
        self._log((*path, "outline"), outline)
        if path not in self._textured:
            self._textured.add(path)
            self._log(path, textured(rr, face.image), static=True)
        self._log(path, rr.Mesh3D.from_fields(vertex_positions=corners))

    def _log_arrow(self, path: Path, track: Track) -> None:
        pose, color = track.filtered, color_of(track.name, self._colors)
        arrow = self._rr.Arrows3D(
            origins=[pose.T_base_object.translation],
            vectors=[_AHEAD * np.asarray(pose.linear_velocity)],
            colors=[color],
            radii=0.003,
        )
        self._log(path, arrow)
