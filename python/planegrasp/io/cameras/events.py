"""What happened to a stream of frames, for people to read and programs to act on."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class StreamStatus(StrEnum):
    """Where a stream of frames stands."""

    RUNNING = "running"
    """Frames come."""
    LOST = "lost"
    """The camera is gone; it is tried again and again."""
    ENDED = "ended"
    """There is no further frame: a recording's end, an error, or the stream was closed."""


class EventKind(StrEnum):
    """What happened."""

    LOST = "lost"
    """The camera vanished or gives no frames."""
    FOUND = "found"
    """It gives frames again."""
    CLOCK = "clock"
    """Timestamps went backwards."""
    RESOLUTION = "resolution"
    """Frames have another size than before."""
    DEPTH_LOST = "depth lost"
    """Colour goes on without depth."""
    DEPTH_FOUND = "depth found"
    """Depth is there again."""
    SOURCE = "source"
    """What the camera's driver has to say, for example that a part of its data is of no use."""
    ENDED = "ended"
    """The recording is at its end."""


@dataclass(frozen=True, slots=True)
class StreamEvent:
    """One thing that happened to a stream.

    Attributes:
        kind: what happened.
        message: one sentence for the user.
        frame: how many frames had been read before.
    """

    kind: EventKind
    message: str
    frame: int
