"""Recordings of messages as frames: images, aligned depth and camera info, of ROS or Foxglove."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.errors import CameraError, InvalidInputError, SourceError
from planegrasp.io.images import MILLIMETRES
from planegrasp.io.pairing import FramePairing
from planegrasp.io.sources.ros_images import camera_of, color_of, depth_of
from planegrasp.io.sources.ros_topics import RecordingTopics, choose_topics
from planegrasp.rgbd import RGBDFrame

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planegrasp.geometry import PinholeCamera
    from planegrasp.io.sources.ros_messages import MessageFile, RecordedMessage

_STAMPS = 20
"""Colour images that tell the frame rate."""

_USUAL_INTERVAL = 1 / 30
_PATIENCE = 30
"""Colour images that wait for their depth, which is recorded later where it has to be aligned."""


class RosRecording:
    """A `FrameSource` over a ROS 1 bag, a ROS 2 recording or an MCAP file (of ROS or Foxglove).

    Colour goes with the depth whose timestamp is nearest, within half a frame; else it comes
    without depth. Frames are named 000000, 000001 and so on.

    Attributes:
        name: of the file or folder.
        length: number of colour images.
        camera: as given, or None where each image has that of the recording.
        topics: what is read.
        notes: see `FrameSource.notes`.
    """

    def __init__(
        self,
        name: str,
        file: MessageFile,
        camera: PinholeCamera | None = None,
        depth_scale: float | None = None,
        topics: RecordingTopics | None = None,
    ) -> None:
        """Choose what to read.

        Args:
            name: what to call the source.
            file: with the messages.
            camera: instead of that of the recording.
            depth_scale: metres per unit of 16-bit depth; millimetres by default, as ROS has it.
            topics: where the choice by name and type is not the right one.

        Raises:
            SourceError: there is no colour image or no camera, or no one choice of them.
            CameraError: the recording's camera is not calibrated.
        """
        self.name = name
        self.camera = camera
        self._file = file
        self._depth_scale = depth_scale or MILLIMETRES
        try:
            filled = {topic: kind for topic, kind in file.types.items() if file.counts[topic]}
            asked = topics or RecordingTopics()
            self.topics = choose_topics(filled, asked, needs_info=camera is None)
        except SourceError as error:
            end = f" ({file.cut_off})" if file.cut_off else ""
            raise SourceError(f"{name}: {error}{end}") from None
        assert self.topics.color is not None
        self.length = file.counts[self.topics.color]
        notes = [file.cut_off] if file.cut_off else []
        if camera is None:
            self._first_camera, note = self._recorded_camera()
            notes += [note] if note else []
        else:
            self._first_camera = camera
        depth = self.topics.depth
        if depth and not any(word in depth for word in ("aligned", "registered")):
            notes.append(f"taking depth of {depth} as aligned to {self.topics.color}")
        if not depth and asked.depth is None:
            notes.append(f"{name} has no depth images")
        self.notes = tuple(notes)
        self._gap = self._half_a_frame()

    def __iter__(self) -> Iterator[RGBDFrame]:
        """The frames in order."""
        names = self.topics
        cameras = _Cameras(self._first_camera, rectified=self._is_rectified)
        pairing: FramePairing[Any, Any] = FramePairing(self._gap, _PATIENCE if names.depth else 0)
        number = 0
        wanted = {name for name in (names.color, names.depth, names.info) if name}
        for raw in self._file.messages(wanted):
            message = raw.read()
            if raw.topic == names.info:
                if self.camera is None:
                    cameras.add(message)
                continue
            bring = pairing.first if raw.topic == names.color else pairing.second
            for stamp, color, depth in bring(_stamp(raw, message), message):
                yield self._frame(cameras, color, depth, stamp, number)
                number += 1
        for stamp, color, depth in pairing.rest():
            yield self._frame(cameras, color, depth, stamp, number)
            number += 1

    @property
    def _is_rectified(self) -> bool:
        return "rect" in str(self.topics.color)

    def _frame(
        self, cameras: _Cameras, color: Any, depth: Any, stamp: float, number: int
    ) -> RGBDFrame:
        topic = self.topics.color
        try:
            image = color_of(color)
            height, width = image.shape[:2]
            metres = None
            if depth is not None:
                topic = self.topics.depth
                metres = depth_of(depth, self._depth_scale)
                if metres.shape != (height, width):
                    raise SourceError(
                        f"depth is {metres.shape[1]}×{metres.shape[0]} and colour "
                        f"{width}×{height}: name a topic of depth that is aligned to colour"
                    )
            camera = cameras.of(width, height)
            return RGBDFrame(image, metres, camera, f"{number:06d}", stamp)
        except (SourceError, InvalidInputError) as error:
            raise type(error)(f"{self.name}, frame {number}, {topic}: {error}") from error

    def _recorded_camera(self) -> tuple[PinholeCamera, str]:
        info = self.topics.info
        assert info is not None
        for raw in self._file.messages({info}):
            try:
                return camera_of(raw.read(), rectified=self._is_rectified)
            except CameraError as error:
                raise CameraError(f"{self.name}, {info}: {error}") from error
        raise SourceError(f"{self.name}: {info} has no message: give a camera file")

    def _half_a_frame(self) -> float:
        color = self.topics.color
        messages = islice(self._file.messages({str(color)}), _STAMPS)
        stamps = np.array([_stamp(raw, raw.read()) for raw in messages])
        intervals = np.diff(stamps)
        intervals = intervals[intervals > 0]
        return float(np.median(intervals) if intervals.size else _USUAL_INTERVAL) / 2


class _Cameras:
    """The latest camera for each image size: a recording may change its resolution."""

    def __init__(self, first: PinholeCamera, *, rectified: bool) -> None:
        self._first = first
        self._rectified = rectified
        self._by_size = {(first.width, first.height): first}

    def add(self, message: Any) -> None:
        camera, _ = camera_of(message, rectified=self._rectified)
        self._by_size[camera.width, camera.height] = camera

    def of(self, width: int, height: int) -> PinholeCamera:
        # Where there is none of this size, the frame says which one does not fit.
        return self._by_size.get((width, height), self._first)


def _stamp(raw: RecordedMessage, message: Any) -> float:
    """When the image was taken [s], or recorded where its header does not say."""
    stamp = message.header.stamp
    seconds = stamp.sec + stamp.nanosec * 1e-9
    return float(seconds) if seconds > 0 else raw.stamp
