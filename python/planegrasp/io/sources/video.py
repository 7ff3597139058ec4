"""A video file as colour frames without depth."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.errors import InvalidInputError, SourceError
from planegrasp.io.sources.base import ASSUMED_FIELD_OF_VIEW, assumed_camera, assumption_note
from planegrasp.io.sources.sequence import fixed_camera
from planegrasp.rgbd import RGBDFrame

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from planegrasp.geometry import PinholeCamera

VIDEO_SUFFIXES = frozenset({".mp4", ".m4v", ".avi", ".mov", ".mkv", ".webm", ".mpg", ".mpeg"})
"""Lower-case suffixes of the files that are opened as videos."""


class VideoSource:
    """A `FrameSource` over a video file; frames are named 000000, 000001 and so on.

    Attributes:
        name: name of the file.
        length: number of frames as the file's header tells it, or None.
        camera: as given, or None where one is assumed.
        notes: see `FrameSource.notes`.

    Raises:
        SourceError: the file is missing, is no video or has no frames.
    """

    def __init__(
        self,
        path: Path,
        camera: PinholeCamera | None = None,
        field_of_view: float | None = None,
    ) -> None:
        if not path.is_file():
            raise SourceError(f"there is no video file {path}")
        self.name = path.name
        self.camera = camera
        self._path = path
        capture = _open(path)
        count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        self._frames_per_second = float(capture.get(cv2.CAP_PROP_FPS))
        capture.release()
        self.length = count if count > 0 else None
        if camera is not None:
            self._camera_for_size = fixed_camera(camera)
            self.notes: tuple[str, ...] = ()
        else:
            angle = ASSUMED_FIELD_OF_VIEW if field_of_view is None else field_of_view
            self._camera_for_size = partial(assumed_camera, field_of_view=angle)
            self.notes = (assumption_note(field_of_view),)

    def __iter__(self) -> Iterator[RGBDFrame]:
        capture = _open(self._path)
        number = 0
        try:
            while True:
                read, bgr = capture.read()
                if not read:
                    break
                yield self._frame(np.asarray(bgr, dtype=np.uint8), number)
                number += 1
        finally:
            capture.release()
        if number == 0:
            raise SourceError(f"{self._path} is a video without a frame that can be decoded")

    def _frame(
        self, bgr: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], number: int
    ) -> RGBDFrame:
        height, width = bgr.shape[:2]
        seconds = number / self._frames_per_second if self._frames_per_second > 0 else None
        color = np.ascontiguousarray(bgr[:, :, ::-1])
        try:
            camera = self._camera_for_size(width, height)
            return RGBDFrame(color, None, camera, f"{number:06d}", seconds)
        except InvalidInputError as error:
            raise type(error)(f"{self._path}, frame {number}: {error}") from error


def _open(path: Path) -> cv2.VideoCapture:
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise SourceError(f"{path} is not a video, or is truncated or damaged")
    return capture
