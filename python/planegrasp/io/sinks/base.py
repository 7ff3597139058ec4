"""What a result sink is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import TracebackType
    from typing import Self

    from planegrasp.detection import Detection
    from planegrasp.rgbd import RGBDFrame


class ResultSink(Protocol):
    """Takes the detections of one frame after another; a context manager that closes at the end."""

    def write(self, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Store the detections of one frame.

        Raises:
            OSError: it cannot be written.
        """
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None: ...
