"""Recording into an RGB-D folder: color/, depth/, camera.json and frames.txt."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, TextIO

import numpy as np

from planegrasp.errors import InvalidInputError, RecordingError
from planegrasp.io.camera_file import write_camera
from planegrasp.io.images import MILLIMETRES, write_color, write_depth
from planegrasp.io.recording.base import Recorder, whole_millimetres
from planegrasp.io.sources.folder import CAMERA_FILE, COLOR_FOLDER, DEPTH_FOLDER
from planegrasp.io.sources.frame_list import END, FRAME_LIST, line_of

if TYPE_CHECKING:
    from pathlib import Path

    from planegrasp.geometry import PinholeCamera
    from planegrasp.rgbd import RGBDFrame

_FINE_SCALE = 0.0002  # for depth that is no whole millimetres: up to 13.1 m [m per unit]


class FolderRecorder(Recorder):
    """Writes an RGB-D folder with a line of `frames.txt` after the images of each frame.

    The first frame with depth decides whether a unit of the depth images is 1 mm or 0.2 mm;
    measurements that do not fit 16 bits of it are left out. All frames have one camera.
    """

    def __init__(self, path: Path) -> None:
        """Begin with an empty folder.

        Raises:
            RecordingError: the folder cannot be made.
        """
        super().__init__(path)
        self._camera: PinholeCamera | None = None
        self._scale: float | None = None
        try:
            (path / COLOR_FOLDER).mkdir(parents=True, exist_ok=True)
            self._list: TextIO = (path / FRAME_LIST).open("w", encoding="utf-8")
        except OSError as error:
            raise RecordingError(f"{path} cannot be written: {error.strerror}") from error

    def _write(self, frame: RGBDFrame, stamp: float) -> None:
        self._write_camera(frame)
        name = f"{self.frames:06d}"
        write_color(self.path / COLOR_FOLDER / f"{name}.png", frame.color)
        if frame.depth is not None and self._scale is not None:
            farthest = np.float32(65535 * self._scale)
            depth = np.where(frame.depth <= farthest, frame.depth, np.float32(0))
            write_depth(self.path / DEPTH_FOLDER / f"{name}.png", depth, self._scale)
        self._list.write(line_of(name, stamp))
        self._list.flush()

    def _write_camera(self, frame: RGBDFrame) -> None:
        if self._camera is not None and frame.camera != self._camera:
            raise InvalidInputError(
                f"an RGB-D folder has one camera for all frames, and frame {self.frames} has "
                f"another one ({frame.camera} instead of {self._camera}): record to NAME.mcap"
            )
        scale = self._scale
        if scale is None and frame.depth is not None:
            scale = MILLIMETRES if whole_millimetres(frame.depth) else _FINE_SCALE
        if self._camera is None or scale != self._scale:
            write_camera(self.path / CAMERA_FILE, frame.camera, scale or MILLIMETRES)
        self._camera, self._scale = frame.camera, scale

    def _finish(self) -> None:
        if not self._list.closed:
            self._list.write(END)
            self._list.close()

    def _give_up(self) -> None:
        with suppress(OSError):  # a line that is not complete does not count
            self._list.close()
