"""What takes the results of one frame after another."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from planegrasp.closing import ClosesAtEnd

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.detection import Detection
    from planegrasp.rgbd import RGBDFrame


class ResultSink(ClosesAtEnd, ABC):
    """Stores or shows the detections of frames; a context manager that closes at the end."""

    @abstractmethod
    def write(self, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Store the detections of one frame.

        Raises:
            OSError: it cannot be written.
        """
