"""What `planegrasp live` tells in the terminal: a line that stays, and a line for each event."""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import TYPE_CHECKING

from planegrasp.cli.common import messages
from planegrasp.closing import ClosesAtEnd

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planegrasp.io.cameras import NewestFrame
    from planegrasp.live import LiveFrame, LiveRates
    from planegrasp.tracking import Track

_EVERY = 0.25  # [s]


class StatusLine(ClosesAtEnd):
    """A line on standard error, where that is a terminal, with events above it."""

    def __init__(self) -> None:
        from rich.live import Live
        from rich.text import Text

        self._console = messages()
        self._stack = ExitStack()
        self._shown = 0.0
        self._line: Live | None = None
        if self._console.is_terminal:
            line = Live(Text("starting"), console=self._console, transient=True, auto_refresh=False)
            self._line = self._stack.enter_context(line)

    def event(self, kind: str, text: str, style: str = "") -> None:
        """Print a line that stays."""
        from rich.text import Text

        line = Text.assemble((f"{kind}: ", style), text)
        self._console.print(line, soft_wrap=True)

    def show(self, stream: NewestFrame, seen: LiveFrame | None, rates: LiveRates | None) -> None:
        """Bring the line up to date, a few times a second."""
        if self._line is None or time.monotonic() - self._shown < _EVERY:
            return
        from rich.text import Text

        self._shown = time.monotonic()
        line = Text(status_text(stream, seen, rates), no_wrap=True, overflow="ellipsis")
        self._line.update(line, refresh=True)

    def close(self) -> None:
        """Remove the line."""
        self._stack.close()


def status_text(stream: NewestFrame, seen: LiveFrame | None, rates: LiveRates | None) -> str:
    """The state of everything in one line."""
    parts = [f"camera {stream.status}"]
    if rates is not None:
        parts = [
            f"camera {stream.status} {rates.camera:.0f} Hz",
            f"tracking {rates.tracking:.0f} Hz {1000 * rates.latency_p50:.1f} ms",
            f"dropped {rates.dropped}",
        ]
    if seen is not None and str(stream.status) != "lost":
        parts.append(objects_text(seen.tracks))
        if seen.skipped:
            parts.append("skipped " + ", ".join(sorted({one.name for one in seen.skipped})))
    return " | ".join(parts)


def objects_text(tracks: Sequence[Track]) -> str:
    """What is followed, with its distance where it is seen."""
    shown = [
        f"{label(t)} {distance(t):.2f} m" if t.detection is not None else f"{label(t)} hidden"
        for t in tracks
    ]
    return ", ".join(shown) or "nothing seen"


def label(track: Track) -> str:
    """An object's name, with the number of a further instance."""
    return track.name if track.instance == 0 else f"{track.name} #{track.instance}"


def distance(track: Track) -> float:
    """From the camera to the object's origin [m], where the camera is the fixed frame."""
    return float((track.filtered.T_base_object.translation**2).sum() ** 0.5)
