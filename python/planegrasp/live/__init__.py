"""A camera's frames as they come: track what is known, look for the rest beside it."""

from planegrasp.live.live import Live, LiveConfig, LiveFrame
from planegrasp.live.rates import LiveRates, RateMeter
from planegrasp.live.task import Skipped, Task
from planegrasp.live.task_file import TaskFile, read_task
from planegrasp.live.urgency import prompt

__all__ = [
    "Live",
    "LiveConfig",
    "LiveFrame",
    "LiveRates",
    "RateMeter",
    "Skipped",
    "Task",
    "TaskFile",
    "prompt",
    "read_task",
]
