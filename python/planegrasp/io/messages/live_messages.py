"""Everything that a live frame says, in messages of ROS by topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.io.messages.frames import FrameIds
from planegrasp.io.messages.header import Header, Stamp
from planegrasp.io.messages.objects import detections_message, tracks_message

if TYPE_CHECKING:
    from planegrasp.io.messages.objects import DetectionsMessage, TracksMessage
    from planegrasp.live import LiveFrame

__all__ = ["live_detections", "live_messages", "live_tracks"]


def live_messages(
    seen: LiveFrame, ids: FrameIds | None = None, header: Header | None = None
) -> tuple[DetectionsMessage, TracksMessage]:
    """What is detected in a frame, and what is followed after it.

    Args:
        seen: of `Live.process`.
        ids: names of frames.
        header: of the image as its source gave it; by default the frame's timestamp and
            `FrameIds.camera`.

    Returns:
        Detections in the camera's frame, and tracks in the fixed one, both with the image's stamp.
    """
    return live_detections(seen, ids, header), live_tracks(seen, ids, header)


def live_detections(
    seen: LiveFrame, ids: FrameIds | None = None, header: Header | None = None
) -> DetectionsMessage:
    """The first of `live_messages`."""
    return detections_message(seen.detections, _header(seen, ids, header), seen.tracks)


def live_tracks(
    seen: LiveFrame, ids: FrameIds | None = None, header: Header | None = None
) -> TracksMessage:
    """The second of `live_messages`."""
    header = _header(seen, ids, header)
    fixed = Header(header.stamp, (ids and ids.fixed) or header.frame_id)
    return tracks_message(seen.tracks, fixed, seen.lost)


def _header(seen: LiveFrame, ids: FrameIds | None, header: Header | None) -> Header:
    if header is not None:
        return header
    return Header(Stamp.from_seconds(seen.frame.timestamp), (ids or FrameIds()).camera)
