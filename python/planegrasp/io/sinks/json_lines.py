"""Detections as JSON Lines: one frame a line, each line complete when the next frame begins."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from planegrasp.io.sinks.as_dict import frame_to_dict
from planegrasp.results import ResultSink

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TextIO

    from planegrasp.detection import Detection
    from planegrasp.rgbd import RGBDFrame


class JsonLinesWriter(ResultSink):
    """Writes one JSON object a frame, keys as in `as_dict`'s docstring.

    Every line is flushed: a program that follows the file has a frame as soon as it is done, and
    a kill loses at most the line that is being written.
    """

    def __init__(self, target: str | Path | TextIO) -> None:
        """Write to a file, replacing it, or to an open text stream, which stays open.

        Raises:
            OSError: the file cannot be opened for writing.
        """
        self._owned = isinstance(target, (str, Path))
        if isinstance(target, (str, Path)):
            path = Path(target)
            path.parent.mkdir(parents=True, exist_ok=True)
            self._stream: TextIO = path.open("w", encoding="utf-8")
        else:
            self._stream = target

    def write(self, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Write the line of one frame, also where nothing was found in it.

        Raises:
            OSError: the line cannot be written.
        """
        line = json.dumps(frame_to_dict(frame, detections), ensure_ascii=False, allow_nan=False)
        self._stream.write(line + "\n")
        self._stream.flush()

    def close(self) -> None:
        """Close the file; a stream that was given stays open."""
        if self._owned:
            self._stream.close()
