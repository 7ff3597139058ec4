"""A detector beside the frames: it looks at one frame while others go by."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from planegrasp import _core
from planegrasp.live.urgency import step_back

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.detection import Detection
    from planegrasp.detector import Detector
    from planegrasp.geometry import RigidTransform
    from planegrasp.rgbd import RGBDFrame

__all__ = ["Found", "SearchThread"]


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What a search gave.

    Attributes:
        detections: in its frame.
        time: of the frame [s].
        T_fixed_camera: pose of the camera then.
    """

    detections: Sequence[Detection]
    time: float
    T_fixed_camera: RigidTransform


@dataclass(frozen=True, slots=True, eq=False)
class _Request:
    frame: RGBDFrame
    time: float
    T_fixed_camera: RigidTransform
    names: Sequence[str]
    closely: bool


class SearchThread:
    """Runs a detector in a thread of its own, one frame at a time.

    It begins with the frame that waits as soon as it is done with the one before, whether or not
    the result of that was taken: what it looks for is gone again in some frames. An error of the
    detector is raised where its result is taken. What the detector does in parallel it does in
    threads apart from those of tracking, which come first where there are not enough processors.
    """

    def __init__(self, detector: Detector) -> None:
        self._detector = detector
        self._changed = threading.Condition()
        self._waiting: _Request | None = None
        # Begun and not taken, the oldest first.
        self._times: deque[float] = deque()
        self._results: deque[Found | BaseException] = deque()
        self._is_closed = False
        self._thread = threading.Thread(target=self._run, name="planegrasp-search", daemon=True)
        self._thread.start()

    @property
    def is_waiting(self) -> bool:
        """Whether the frame that was offered last was not begun yet."""
        with self._changed:
            return self._waiting is not None

    @property
    def oldest(self) -> float | None:
        """Time of the oldest frame of which a result is to come [s], None where there is none."""
        with self._changed:
            if self._times:
                return self._times[0]
            return None if self._waiting is None else self._waiting.time

    def offer(
        self,
        frame: RGBDFrame,
        time: float,
        T_fixed_camera: RigidTransform,
        names: Sequence[str],
        *,
        closely: bool,
    ) -> None:
        """Look for some objects in a frame, instead of in one that waits still.

        See `Detector.detect` for `closely`.
        """
        with self._changed:
            self._waiting = _Request(frame, time, T_fixed_camera, names, closely)
            self._changed.notify_all()

    def take(self) -> Found | None:
        """The oldest result, once; None while there is none. Never waits."""
        with self._changed:
            if not self._results:
                return None
            result = self._results.popleft()
            self._times.popleft()
        if isinstance(result, BaseException):
            raise result
        return result

    def close(self) -> None:
        """End the thread; a frame that it is at is finished first."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        self._thread.join()

    def _run(self) -> None:
        threads = _core.ThreadPool(step_back)
        while (request := self._next()) is not None:
            result: Found | BaseException
            try:
                detections = self._detector.detect(
                    request.frame, request.names, closely=request.closely
                )
                result = Found(detections, request.time, request.T_fixed_camera)
            except Exception as error:
                result = error
            with self._changed:
                self._results.append(result)
        del threads

    def _next(self) -> _Request | None:
        with self._changed:
            while self._waiting is None and not self._is_closed:
                self._changed.wait()
            if self._is_closed or self._waiting is None:
                return None
            request, self._waiting = self._waiting, None
            self._times.append(request.time)
            return request
