"""Detections of a sequence of frames in an MCAP file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.io.foxglove.stream import FoxgloveStream
from planegrasp.results import ResultSink

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from planegrasp.detection import Detection
    from planegrasp.io.foxglove.config import FoxgloveConfig
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

__all__ = ["DetectionsLog"]


class DetectionsLog(ResultSink):
    """Writes frames and what was detected in them, each frame as soon as it is done."""

    def __init__(
        self,
        path: str | Path,
        models: Iterable[ObjectModel] = (),
        config: FoxgloveConfig | None = None,
    ) -> None:
        """Begin a new file.

        Args:
            path: of the file, ending in .mcap.
            models: that are looked for; they are in the log as additions to a library.
            config: what is logged.

        Raises:
            RecordingError: it exists already, or cannot be written.
        """
        self._stream = FoxgloveStream(models, config)
        self._stream.log_to(path)

    def write(self, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Write one frame.

        Raises:
            RecordingError: it cannot be written; the frames before can be read.
        """
        self._stream.detections(frame, detections)

    def close(self) -> None:
        """Finish the file.

        Raises:
            RecordingError: its end cannot be written; all frames can be read nevertheless.
        """
        self._stream.close()
