"""What takes the results of one frame after another."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType
    from typing import Self

    from planegrasp.detection import Detection
    from planegrasp.rgbd import RGBDFrame


class ResultSink(ABC):
    """Stores or shows the detections of frames; a context manager that closes at the end."""

    @abstractmethod
    def write(self, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Store the detections of one frame.

        Raises:
            OSError: it cannot be written.
        """

    def close(self) -> None:  # noqa: B027 - most sinks hold nothing open
        """Write what is still buffered and release what is held open."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
