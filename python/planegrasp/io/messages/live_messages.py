"""Everything that a live frame says, in messages of ROS by topic."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.io.messages.frames import FrameIds
from planegrasp.io.messages.header import Header, Stamp
from planegrasp.io.messages.objects import detections_message, tracks_message

if TYPE_CHECKING:
    from planegrasp.io.messages.objects import DetectionsMessage, TracksMessage
    from planegrasp.live import LiveFrame

__all__ = ["live_messages"]


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
    ids = ids or FrameIds()
    if header is None:
        header = Header(Stamp.from_seconds(seen.frame.timestamp), ids.camera)
    fixed = Header(header.stamp, ids.fixed or header.frame_id)
    return (
        detections_message(seen.detections, header, seen.tracks),
        tracks_message(seen.tracks, fixed, seen.lost),
    )
