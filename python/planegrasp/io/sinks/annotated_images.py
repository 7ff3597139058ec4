"""Every frame with its detections drawn on it, as one PNG a frame."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from planegrasp.io.images import write_color
from planegrasp.results import ResultSink
from planegrasp.viz.overlay import draw_detections

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planegrasp.detection import Detection
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.viz.palette import RGB


class AnnotatedImageWriter(ResultSink):
    """Writes `FOLDER/FRAME.png`, see `planegrasp.viz.overlay`."""

    def __init__(self, folder: str | Path, colors: Mapping[str, RGB] | None = None) -> None:
        """Write into a folder, which is created; colours by object name as `object_colors` gives.

        Raises:
            OSError: the folder cannot be created.
        """
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self._colors = colors
        self._written = 0

    def write(self, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Write the picture of one frame; frames without a name are counted.

        Raises:
            OSError: the picture cannot be written.
        """
        name = re.sub(r"[^\w.-]", "_", frame.name).strip(".") or f"{self._written:06d}"
        image = draw_detections(frame, detections, self._colors)
        write_color(self.folder / f"{name}.png", image)
        self._written += 1
