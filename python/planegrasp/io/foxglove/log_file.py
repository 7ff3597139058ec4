"""An MCAP file that takes what is logged in a context."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import foxglove
from foxglove.mcap import MCAPWriteOptions

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import RecordingError

if TYPE_CHECKING:
    from io import BufferedWriter

__all__ = ["McapLog"]

SUFFIX = ".mcap"


class McapLog(ClosesAtEnd):
    """Writes a chunk a frame, from its start to its end at once; a context manager.

    A frame whose chunk is complete can be read back, also where the process is killed after it or
    the disk gets full.

    Attributes:
        path: of the file.
        frames: how many are in complete chunks.
    """

    def __init__(self, path: str | Path, context: foxglove.Context) -> None:
        """Begin a new file.

        Args:
            path: of the file, ending in .mcap; its folder is made.
            context: whose channels go into it.

        Raises:
            RecordingError: there is something of that name already, it does not end in .mcap, or it
                cannot be written.
        """
        self.path = Path(path)
        self.frames = 0
        if self.path.suffix.lower() != SUFFIX:
            raise RecordingError(f"{path} names no MCAP file: give NAME{SUFFIX}")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = _Target(self.path.open("xb"))
        except OSError as error:
            if self.path.exists():
                raise RecordingError(f"{path} exists already: give a new name") from error
            raise RecordingError(f"{path} cannot be written: {error.strerror}") from error
        # Without seeking nothing is written twice: a file that is cut has whole records before
        # the cut. Without a size only `complete` ends a chunk.
        options = MCAPWriteOptions(disable_seeking=True, chunk_size=None, compression_threads=0)
        self._writer = foxglove.open_mcap(self._file, context=context, writer_options=options)
        self._is_closed = False

    def complete(self, frames: int = 1) -> None:
        """Write what was logged since the last time.

        Args:
            frames: how many these were.

        Raises:
            RecordingError: it cannot be written, for example because the disk is full; what was
                complete before can be read. Close the log then.
        """
        self._writer.flush()
        if self._file.error is not None:
            raise self._failure(self._file.error)
        self.frames += frames

    def close(self) -> None:
        """Write the table of contents.

        Raises:
            RecordingError: it cannot be written; all frames can be read nevertheless.
        """
        if self._is_closed:
            return
        self._is_closed = True
        failed_before = self._file.error is not None
        self._writer.close()
        self._file.close()
        if self._file.error is not None and not failed_before:
            raise RecordingError(
                f"the end of {self.path} cannot be written: {_reason(self._file.error)}; its "
                f"{self.frames} frames can be read"
            ) from self._file.error

    def _failure(self, error: OSError) -> RecordingError:
        failure = RecordingError(
            f"{self.path} cannot be written any further: {_reason(error)}; the {self.frames} "
            f"frames before can be read"
        )
        failure.__cause__ = error
        return failure


class _Target:
    """A file that keeps its first error and takes nothing after it.

    The writer logs errors in a channel instead of raising them, and would go on behind a gap.
    """

    def __init__(self, file: BufferedWriter) -> None:
        self.error: OSError | None = None
        self._file = file
        self._position = 0

    def write(self, data: bytes | bytearray) -> int:
        """Append."""
        if self.error is None:
            try:
                self._file.write(data)
            except OSError as error:
                self.error = error
        self._position += len(data)
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        """Tell the position: a writer that does not seek asks for nothing else."""
        return self._position

    def flush(self) -> None:
        """Hand over to the system."""
        if self.error is None:
            try:
                self._file.flush()
            except OSError as error:
                self.error = error

    def close(self) -> None:
        """Flush and close."""
        try:
            self._file.close()
        except OSError as error:
            self.error = self.error or error


def _reason(error: OSError) -> str:
    return error.strerror or str(error)
