"""The folder that the demonstration writes.

objects/          the library, as `planegrasp teach` writes it
recording/        color/, depth/, camera.json and truth.jsonl: a source for `planegrasp detect`
found/            every frame with what was found drawn in
found.jsonl       what was found, a frame a line
found.rrd         the same for the Rerun viewer, where rerun-sdk is installed
filmstrip.png     four of the frames side by side
"""

from __future__ import annotations

import json
from contextlib import ExitStack
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.closing import ClosesAtEnd
from planegrasp.io.camera_file import write_camera
from planegrasp.io.images import read_color, write_color, write_depth
from planegrasp.io.sinks import AnnotatedImageWriter, JsonLinesWriter
from planegrasp.viz.filmstrip import filmstrip
from planegrasp.viz.palette import object_colors

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planegrasp.demo.scene import Shot
    from planegrasp.detection import Detection
    from planegrasp.objects import ObjectModel
    from planegrasp.results import ResultSink

_DEPTH_SCALE = 0.0002  # metres a unit: finer than the sensor's steps
_CELL_WIDTH = 390  # of the filmstrip [px]


class DemoFolder(ClosesAtEnd):
    """Writes everything that is made of the frames; a context manager that closes the files.

    Attributes:
        path: the folder.
        has_recording: whether a Rerun recording is among the files.
    """

    def __init__(self, path: Path, models: Sequence[ObjectModel]) -> None:
        """Begin with a folder that has no frames of an earlier run.

        Raises:
            OSError: the folder cannot be written.
        """
        self.path = path
        self.has_recording = find_spec("rerun") is not None
        for folder in (self._color, self._depth, self.found):
            folder.mkdir(parents=True, exist_ok=True)
            for frame in folder.glob("frame-*.png"):
                frame.unlink()
        self._stack = ExitStack()
        colors = object_colors(model.name for model in models)
        sinks: list[ResultSink] = [
            AnnotatedImageWriter(self.found, colors),
            JsonLinesWriter(self.path / "found.jsonl"),
        ]
        if self.has_recording:
            from planegrasp.viz.rerun_recording import RerunRecording

            sinks.append(RerunRecording(self.path / "found.rrd", models, colors))
        self._sinks = [self._stack.enter_context(sink) for sink in sinks]
        self._truth = self._stack.enter_context(
            (self.recording / "truth.jsonl").open("w", encoding="utf-8")
        )
        self._names: list[str] = []

    @property
    def recording(self) -> Path:
        """The frames with their truth."""
        return self.path / "recording"

    @property
    def found(self) -> Path:
        """The frames with what was found."""
        return self.path / "found"

    @property
    def filmstrip(self) -> Path:
        """Four frames side by side."""
        return self.path / "filmstrip.png"

    @property
    def _color(self) -> Path:
        return self.recording / "color"

    @property
    def _depth(self) -> Path:
        return self.recording / "depth"

    def write(self, shot: Shot, detections: Sequence[Detection]) -> None:
        """Write one frame, its truth and what was found in it."""
        frame = shot.frame
        if not self._names:
            write_camera(self.recording / "camera.json", frame.camera, _DEPTH_SCALE)
        self._names.append(frame.name)
        write_color(self._color / f"{frame.name}.png", frame.color)
        if frame.depth is not None:
            write_depth(self._depth / f"{frame.name}.png", frame.depth, _DEPTH_SCALE)
        poses = {name: T.as_matrix().tolist() for name, T in shot.truth.items()}
        line: dict[str, Any] = {"frame": frame.name, "T_camera_object": poses}
        self._truth.write(json.dumps(line) + "\n")
        for sink in self._sinks:
            sink.write(frame, detections)

    def write_filmstrip(self, cells: int = 4) -> None:
        """Lay out frames at equal distances in time."""
        last = len(self._names) - 1
        picked = np.unique(np.linspace(0.1 * last, 0.8 * last, cells).round().astype(int))
        images = [read_color(self.found / f"{self._names[i]}.png") for i in picked]
        write_color(self.filmstrip, filmstrip(images, columns=2, cell_width=_CELL_WIDTH))

    def close(self) -> None:
        """Finish what is being written."""
        self._stack.close()
