"""A camera's frames as they come: track what is known, look for the rest beside it."""

from planegrasp.live.live import Live, LiveConfig, LiveFrame
from planegrasp.live.task import Skipped, Task

__all__ = ["Live", "LiveConfig", "LiveFrame", "Skipped", "Task"]
