"""Another participant of ROS 2 in a process of its own, which is told what to do in lines of JSON.

`ros2/proof` is one on another DDS; run as a module, this is one on the same. Both take the same
arguments and lines (see `ros2/proof/src/main.rs`).
"""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import PlanegraspError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

__all__ = ["Endpoint", "Peer"]

_START = 30.0  # longest time until it is ready, and until it has ended [s]


@dataclass(frozen=True, slots=True)
class Endpoint:
    """What a peer reads or writes.

    Attributes:
        topic: its name.
        message: its type.
        profile: "default", "sensor", "tf" or "kept".
    """

    topic: str
    message: str
    profile: str = "default"


class Peer(ClosesAtEnd):
    """The process.

    Attributes:
        started: when it was started [s], of `time.time`.
    """

    def __init__(
        self,
        domain: int,
        reads: Sequence[Endpoint] = (),
        writes: Sequence[Endpoint] = (),
        program: Path | None = None,
        *,
        brief: bool = False,
    ) -> None:
        """Start it, and wait until it is ready.

        Args:
            domain: of DDS.
            reads: what it shall listen to.
            writes: what it shall be able to write.
            program: of another implementation; by default it is one in Python.
            brief: whether it says of messages only their stamp.

        Raises:
            PlanegraspError: it did not start.
        """
        command = (
            [str(program)] if program else [sys.executable, "-m", f"{__package__}.ros2_python_peer"]
        )
        command += [str(domain), *(["--brief"] if brief else [])]
        for option, endpoints in (("--read", reads), ("--write", writes)):
            for one in endpoints:
                command += [option, one.topic, one.message, one.profile]
        self.started = time.time()
        self._lines: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        try:
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
        except OSError as error:
            raise PlanegraspError(
                f"{command[0]} cannot be run as a peer ({error.strerror}): give the program "
                f"ros2-peer that `make proof` builds"
            ) from error
        # A thread reads, or the process would wait for who does not.
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()
        if self.next(_START) != {"ready": True}:
            self.kill()
            raise PlanegraspError(f"{command[0]} did not start as a peer; is it ros2-peer?")

    def next(self, seconds: float) -> dict[str, Any] | None:
        """The next line that it says, None where it says none for so long [s] or has ended."""
        try:
            return self._lines.get(timeout=max(seconds, 0.0))
        except queue.Empty:
            return None

    def taken(self) -> list[dict[str, Any]]:
        """All lines that it has said by now."""
        lines = []
        while not self._lines.empty():
            if (line := self._lines.get()) is not None:
                lines.append(line)
        return lines

    def write(self, topic: str, message: Any) -> None:
        """Let it publish a message, given as `message_to_json` has it."""
        self._say({"write": {"topic": topic, "message": message}})

    def play(self, frames: Sequence[Sequence[tuple[str, Any]]], rate: float, count: int) -> None:
        """Let it publish groups of messages in turn; it says ``{"played": count}`` at the end.

        Args:
            frames: topic and message of each one of a group, which all get the time as stamp.
            rate: groups a second.
            count: of groups, in all.
        """
        groups = [[{"topic": t, "message": m} for t, m in frame] for frame in frames]
        self._say({"play": {"frames": groups, "rate": rate, "count": count}})

    def kill(self) -> None:
        """End it at once (SIGKILL): it can tell nobody."""
        self._process.kill()
        self._end()

    def close(self) -> None:
        """Let it leave."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        try:
            self._process.wait(_START)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._end()

    def _end(self) -> None:
        self._process.wait()
        self._thread.join()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()

    def _say(self, line: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(line) + "\n")
        self._process.stdin.flush()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(json.loads(line))
        self._lines.put(None)
