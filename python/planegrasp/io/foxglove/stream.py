"""Logs what is seen for Foxglove, at once into a file and to a server."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foxglove import Context

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import RecordingError
from planegrasp.io.foxglove.channels import Channels
from planegrasp.io.foxglove.config import FoxgloveConfig, FoxgloveTopics
from planegrasp.io.foxglove.log_file import McapLog
from planegrasp.io.foxglove.pictures import Pictures
from planegrasp.io.foxglove.server import FoxgloveServer
from planegrasp.io.foxglove.space import Space
from planegrasp.io.foxglove.words import Words
from planegrasp.io.messages.frames import FrameIds
from planegrasp.io.messages.grasps import GraspPlanMessage
from planegrasp.io.messages.header import Header, Stamp
from planegrasp.io.messages.library import library_events
from planegrasp.io.messages.live_messages import live_messages
from planegrasp.io.messages.objects import detections_message
from planegrasp.io.recording.base import stamp_after
from planegrasp.viz.palette import object_colors

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from planegrasp.detection import Detection
    from planegrasp.geometry import RigidTransform
    from planegrasp.io.foxglove.server import ServerAddress
    from planegrasp.io.messages.grasps import GraspRefusalMessage
    from planegrasp.io.messages.library import LibraryEvent
    from planegrasp.live import LiveFrame
    from planegrasp.objects import ObjectModel
    from planegrasp.rgbd import RGBDFrame

__all__ = ["FoxgloveStream"]


class FoxgloveStream(ClosesAtEnd):
    """Logs frames and what is seen in them; a context manager that ends file and server.

    Each message is made once, whoever takes it; images not at all where nobody does.

    Attributes:
        config: what is logged.
        log: the file, None where there is none or it cannot be written any further.
        server: the live server, None where there is none.
    """

    def __init__(
        self,
        models: Iterable[ObjectModel] = (),
        config: FoxgloveConfig | None = None,
        ids: FrameIds | None = None,
        topics: FoxgloveTopics | None = None,
        body_frame: str = "camera_link",
    ) -> None:
        """Prepare the channels.

        Args:
            models: all objects that may be seen; the log begins with them.
            config: what is logged.
            ids: names of frames.
            topics: names of topics.
            body_frame: what to call the camera's body frame (x forward, y left, z up), the parent
                of its optical frame; "" for none. There is none either for frames whose source
                gave a header: such a source has frames of its own.
        """
        models = tuple(models)
        self.config = config or FoxgloveConfig()
        self.log: McapLog | None = None
        self.server: FoxgloveServer | None = None
        self._ids = ids or FrameIds()
        self._body_frame = body_frame
        self._last: float | None = None
        self._is_closed = False
        self._context = Context()
        self._channels = Channels(self._context, topics or FoxgloveTopics(), self.config.color)
        colors = object_colors(model.name for model in models)
        self._pictures = Pictures(self._channels, self.config, colors)
        self._space = Space(self._channels, self._ids, colors)
        self._words = Words(self._channels)
        self.library(library_events((), models, Stamp()))

    def log_to(self, path: str | Path) -> McapLog:
        """Log into a new MCAP file, too; raises as `McapLog` does."""
        self.log = McapLog(path, self._context)
        return self.log

    def serve(self, address: ServerAddress | None = None) -> FoxgloveServer:
        """Serve it live, too; raises as `FoxgloveServer` does."""
        self.server = FoxgloveServer(self._context, address)
        return self.server

    def live(
        self,
        seen: LiveFrame,
        header: Header | None = None,
        T_fixed_camera: RigidTransform | None = None,
    ) -> None:
        """Log a frame, and what is detected and followed in it.

        Args:
            seen: of `Live.process`.
            header: of the frame's image as its source gave it, see `live_messages`.
            T_fixed_camera: pose of the camera in `FrameIds.fixed`, where it moves.

        Raises:
            RecordingError: the file cannot be written any further; what was written before can be
                read. The file is closed, and the server goes on.
        """
        body_frame = self._body_frame if header is None else ""
        header = self._at(seen.frame, header)
        detections, tracks = live_messages(seen, self._ids, header)
        self._channels.document(detections, header.stamp)
        self._channels.document(tracks, header.stamp)
        self._space.log(detections, tracks, body_frame, T_fixed_camera)
        self._pictures.log(header, seen.frame, seen.detections)
        self._complete(frames=1)

    def detections(
        self, frame: RGBDFrame, detections: Sequence[Detection], header: Header | None = None
    ) -> None:
        """Log a frame and what is detected in it; arguments and errors as of `live`."""
        body_frame = self._body_frame if header is None else ""
        header = self._at(frame, header)
        message = detections_message(detections, header)
        self._channels.document(message, header.stamp)
        self._space.log(message, None, body_frame)
        self._pictures.log(header, frame, detections)
        self._complete(frames=1)

    def grasp(self, message: GraspPlanMessage | GraspRefusalMessage) -> None:
        """Log what a planner said; raises as `live` does."""
        self._channels.document(message, message.header.stamp)
        self._space.grasp(message)
        if isinstance(message, GraspPlanMessage):
            self._words.say(f"grasp: {message.name} by {message.grasp!r}", "INFO")
        else:
            self._words.say(f"no grasp of {message.name}: {message.reason}", "WARN")
        self._complete(frames=0)

    def library(self, events: Iterable[LibraryEvent]) -> None:
        """Log what happened to the library: at its stamp, at the last frame's without one."""
        for event in events:
            self._words.library(event)

    def note(self, text: str, level: str = "INFO") -> None:
        """Log in words what happened, at the time of the last frame; INFO, WARN or ERROR."""
        self._words.say(text, level)

    def close(self) -> None:
        """Finish the file, and end the server.

        Raises:
            RecordingError: the end of the file cannot be written; all frames can be read.
        """
        if self._is_closed:
            return
        self._is_closed = True
        try:
            self._words.close()
            self._complete(frames=0)
            if self.log is not None:
                self.log.close()
        finally:
            if self.server is not None:
                self.server.close()
            self._channels.close()

    def _at(self, frame: RGBDFrame, header: Header | None) -> Header:
        """The header of a frame, whose time it is now."""
        if header is None:
            stamp = Stamp.from_seconds(max(0.0, stamp_after(self._last, frame.timestamp)))
            header = Header(stamp, self._ids.camera)
        self._last = header.stamp.to_seconds()
        self._words.at(header.stamp)
        return header

    def _complete(self, *, frames: int) -> None:
        if self.log is None:
            return
        try:
            self.log.complete(frames)
        except RecordingError:
            log, self.log = self.log, None
            log.close()
            raise
