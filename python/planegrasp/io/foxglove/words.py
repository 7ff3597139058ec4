"""Logs what happens besides the frames: to the library, and in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foxglove.messages import Log, LogLevel

from planegrasp.io.foxglove.values import timestamp
from planegrasp.io.messages.header import Stamp

if TYPE_CHECKING:
    from planegrasp.io.foxglove.channels import Channels
    from planegrasp.io.messages.library import LibraryEvent

__all__ = ["Words"]

_LEVELS = {"INFO": LogLevel.Info, "WARN": LogLevel.Warning, "ERROR": LogLevel.Error}


class Words:
    """Logs at the time of the last frame; what comes before the first one waits for its time.

    Frames of a recording have the time of the recording, so the clock would be the wrong one.
    """

    def __init__(self, channels: Channels) -> None:
        self._channels = channels
        self._stamp: Stamp | None = None
        self._waiting: list[LibraryEvent | tuple[str, str]] = []

    def at(self, stamp: Stamp) -> None:
        """It is the time of a frame: log what waits for it."""
        self._stamp = stamp
        waiting, self._waiting = self._waiting, []
        for one in waiting:
            self._log(one, stamp)

    def library(self, event: LibraryEvent) -> None:
        """Log what happened to the library."""
        self._take(event)

    def say(self, text: str, level: str) -> None:
        """Log a text; level is INFO, WARN or ERROR."""
        self._take((text, level))

    def close(self) -> None:
        """Log what waited in vain for a frame."""
        if self._stamp is None:
            self.at(Stamp())

    def _take(self, what: LibraryEvent | tuple[str, str]) -> None:
        if self._stamp is None:
            self._waiting.append(what)
        else:
            self._log(what, self._stamp)

    def _log(self, what: LibraryEvent | tuple[str, str], stamp: Stamp) -> None:
        if isinstance(what, tuple):
            text, level = what
        else:
            stamp = what.stamp if what.stamp.total_nanoseconds else stamp
            self._channels.document(what, stamp)
            text, level = f"object {what.kind}: {what.name}", "INFO"
        message = Log(
            timestamp=timestamp(stamp), level=_LEVELS[level], message=text, name="planegrasp"
        )
        self._channels.events.log(message, log_time=stamp.total_nanoseconds)
