"""A detector beside the frames: it looks at one frame while others go by."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING

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


class SearchThread:
    """Runs a detector in a thread of its own, one frame at a time.

    An error of the detector is raised where its result is taken.
    """

    def __init__(self, detector: Detector) -> None:
        self._detector = detector
        self._changed = threading.Condition()
        self._request: _Request | None = None
        self._result: Found | BaseException | None = None
        self._is_busy = False
        self._is_closed = False
        self._thread = threading.Thread(target=self._run, name="planegrasp-search", daemon=True)
        self._thread.start()

    @property
    def is_idle(self) -> bool:
        """Whether it can be given a frame; results must have been taken."""
        with self._changed:
            return not self._is_busy and self._request is None and self._result is None

    def start(
        self,
        frame: RGBDFrame,
        time: float,
        T_fixed_camera: RigidTransform,
        names: Sequence[str],
    ) -> None:
        """Look for some objects in a frame; it must be idle."""
        with self._changed:
            self._request = _Request(frame, time, T_fixed_camera, names)
            self._changed.notify_all()

    def take(self) -> Found | None:
        """The result of the last frame, once; None while there is none. Never waits."""
        with self._changed:
            result, self._result = self._result, None
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
        while True:
            with self._changed:
                while self._request is None and not self._is_closed:
                    self._changed.wait()
                if self._is_closed or self._request is None:
                    return
                request, self._request, self._is_busy = self._request, None, True
            result: Found | BaseException
            try:
                detections = self._detector.detect(request.frame, among=request.names)
                result = Found(detections, request.time, request.T_fixed_camera)
            except Exception as error:
                result = error
            with self._changed:
                self._result, self._is_busy = result, False
