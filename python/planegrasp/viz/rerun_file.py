"""Writing an .rrd file so that it can be read whatever happens to the disk or the process.

Rerun's own writer may end a file within a message when the disk is full, which its reader refuses,
and then waits for itself without end. So Rerun writes into a pipe, and what comes out of it goes to
the disk here, by whole messages.
"""

from __future__ import annotations

import os
import struct
from threading import Thread
from typing import TYPE_CHECKING

from planegrasp.errors import RecordingError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path
    from typing import BinaryIO

__all__ = ["RrdFile"]

# A file is this and 8 bytes more, then messages: kind and length, 64 bits each, and the content.
_MAGIC, _START = b"RRF2", 12
_HEADER = struct.Struct("<QQ")
_END = 0  # kind of the last message; a little follows that is none
_BLOCK = 1 << 16


class RrdFile:
    """A new file that Rerun writes through a pipe.

    Attributes:
        path: of the file.
        error: why nothing is written any more, None while it is; what was written before can be
            read.
    """

    def __init__(self, path: Path) -> None:
        """Make the file and the pipe.

        Raises:
            RecordingError: the file exists already, or cannot be made.
        """
        self.path = path
        self.error: OSError | None = None
        self._size = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb", buffering=0)
        except OSError as error:
            if path.exists():
                raise RecordingError(f"{path} exists already: give a new name") from error
            raise RecordingError(f"{path} cannot be written: {error.strerror}") from error
        out, self._into = os.pipe()
        self._pipe = os.fdopen(out, "rb")
        self._thread = Thread(target=self._run, name=f"writing {path}", daemon=True)
        self._thread.start()

    @property
    def entrance(self) -> str:
        """What Rerun is to write to."""
        return f"/dev/fd/{self._into}"

    def entered(self) -> None:
        """Rerun has opened the entrance: the file ends when Rerun closes it."""
        os.close(self._into)

    def finish(self) -> None:
        """Wait until all is written; Rerun must have closed the entrance."""
        self._thread.join()

    def _run(self) -> None:
        with self._pipe as pipe, self._file:
            for message in _messages(pipe):
                # After an error everything is still taken, so that Rerun never waits.
                if self.error is None:
                    self._write(memoryview(message))

    def _write(self, message: memoryview) -> None:
        written = 0
        try:
            while written < len(message):
                written += self._file.write(message[written:])
        except OSError as error:
            self._file.truncate(self._size)
            self.error = error
        else:
            self._size += written


def _messages(pipe: BinaryIO) -> Iterator[bytes]:
    """What may be on the disk or not, but no part of it alone."""
    start = pipe.read(_START)
    yield start
    while start.startswith(_MAGIC) and (header := pipe.read(_HEADER.size)):
        kind, length = _HEADER.unpack(header)
        if kind == _END:
            yield header + pipe.read()
            return
        yield header + pipe.read(length)
    while block := pipe.read(_BLOCK):  # a form of file that is not known here
        yield block
