"""Live cameras, and the newest frame of a camera or a recording."""

from planegrasp.io.cameras.base import Camera
from planegrasp.io.cameras.events import EventKind, StreamEvent, StreamStatus
from planegrasp.io.cameras.newest import NewestFrame, StreamConfig
from planegrasp.io.cameras.opening import is_camera_name, open_camera

__all__ = [
    "Camera",
    "EventKind",
    "NewestFrame",
    "StreamConfig",
    "StreamEvent",
    "StreamStatus",
    "is_camera_name",
    "open_camera",
]
