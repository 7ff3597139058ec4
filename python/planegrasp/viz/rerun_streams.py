"""Where live data for Rerun goes: a file, a viewer, a browser; and what happens when that ends.

Rerun writes and sends in threads of its own, and reports what failed only when it is asked to
flush. So a stream is flushed now and then, and a failure becomes an exception here.
"""

from __future__ import annotations

import socket
import struct
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import RecordingError, ViewerError
from planegrasp.viz.rerun_parts import begun, rerun

if TYPE_CHECKING:
    from typing import BinaryIO

__all__ = ["GRPC_PORT", "WEB_PORT", "RerunStream", "to_browser", "to_file", "to_viewer"]

GRPC_PORT = 9876
"""At which a viewer is sent its data."""
WEB_PORT = 9090
"""At which a browser finds the viewer."""

# A flush that takes longer means that nobody takes the data [s].
_PATIENCE = 10.0
# How often a stream is asked whether it still works [s].
_CHECK_EVERY = 0.5


class RerunStream(ClosesAtEnd):
    """A Rerun stream that says when it ends; a context manager.

    Attributes:
        stream: Rerun's `RecordingStream`.
        url: where a browser finds it, "" for none.
    """

    def __init__(self, stream: Any, target: str, path: Path | None = None, url: str = "") -> None:
        """Take over a stream.

        Args:
            stream: of Rerun, with a sink.
            target: what to call it in errors.
            path: of the file, where it is one.
            url: for a browser.
        """
        self.stream = stream
        self.url = url
        self._target, self._path = target, path
        self._checked = time.monotonic()
        self._has_failed = False

    def check(self) -> None:
        """See, now and then, whether what was logged arrives.

        Raises:
            ViewerError: the viewer is gone, or takes nothing.
            RecordingError: the file cannot be written any further; what is in it can be read.
        """
        if time.monotonic() - self._checked >= _CHECK_EVERY:
            self.flush()

    def flush(self) -> None:
        """Wait until everything has arrived; raises as `check` does."""
        self._checked = time.monotonic()
        try:
            self.stream.flush(timeout_sec=_PATIENCE)
        except RuntimeError as error:
            self._has_failed = True
            if self._path is None:
                raise ViewerError(f"{self._target} takes no data any more: {error}") from error
            self.stream.disconnect()
            cut_to_whole_messages(self._path)
            raise RecordingError(
                f"{self._path} cannot be written any further, is the disk full? What was written "
                f"before can be read ({error})"
            ) from error

    def close(self) -> None:
        """Hand over what is left, and end.

        Raises:
            RecordingError: the end of the file cannot be written.
        """
        try:
            if not self._has_failed:
                self.flush()
        finally:
            self.stream.disconnect()


def to_file(path: str | Path, blueprint: Any) -> RerunStream:
    """Into a new .rrd file.

    Raises:
        RecordingError: it exists already, or cannot be written.
        MissingExtraError: rerun-sdk is not installed.
    """
    path = Path(path)
    if path.exists():
        raise RecordingError(f"{path} exists already: give a new name")
    try:
        stream = begun(rerun(), path, blueprint)
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {error}") from error
    return RerunStream(stream, str(path), path)


def to_viewer(blueprint: Any, port: int = GRPC_PORT, memory: str = "2GB") -> RerunStream:
    """To Rerun's viewer on this computer, which is started unless one listens already.

    Args:
        blueprint: how to arrange it.
        port: at which the viewer listens.
        memory: that the viewer uses at most; then it forgets what is oldest.

    Raises:
        ViewerError: it does not start.
        MissingExtraError: rerun-sdk is not installed.
    """
    rr = rerun()
    stream = rr.RecordingStream("planegrasp")
    try:
        if _is_free(port):
            stream.spawn(port=port, memory_limit=memory, connect=False, hide_welcome_screen=True)
        stream.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy", default_blueprint=blueprint)
        stream.flush(timeout_sec=_PATIENCE)
    except RuntimeError as error:
        raise ViewerError(
            f"the Rerun viewer does not start, or what listens at port {port} is none ({error}): "
            f"is there a display? Without one, a browser shows it, or it goes to a file"
        ) from error
    return RerunStream(stream, "the Rerun viewer")


def to_browser(
    blueprint: Any,
    port: int = GRPC_PORT,
    web_port: int = WEB_PORT,
    memory: str = "1GB",
    *,
    opens: bool = True,
) -> RerunStream:
    """To browsers: this process serves the viewer and its data.

    Args:
        blueprint: how to arrange it.
        port: of the data.
        web_port: of the page.
        memory: in which data is kept for browsers that come late; then what is oldest is dropped.
        opens: whether to open a browser here.

    Raises:
        ViewerError: a port is taken.
        MissingExtraError: rerun-sdk is not installed.
    """
    rr = rerun()
    for number in (port, web_port):
        if not _is_free(number):
            raise ViewerError(f"port {number} is taken: is there another viewer? Give a free port")
    stream = rr.RecordingStream("planegrasp")
    try:
        uri = stream.serve_grpc(
            grpc_port=port, default_blueprint=blueprint, server_memory_limit=memory
        )
        rr.serve_web_viewer(web_port=web_port, open_browser=opens, connect_to=uri)
        stream.flush(timeout_sec=_PATIENCE)
    except RuntimeError as error:
        raise ViewerError(f"the viewer for browsers does not start: {error}") from error
    url = f"http://127.0.0.1:{web_port}/?url={quote(uri, safe='')}"
    return RerunStream(stream, "the viewer for browsers", url=url)


def cut_to_whole_messages(path: Path) -> None:
    """Drop half a message at the end of an .rrd file: Rerun's reader refuses the file with it.

    A file is a header of 12 bytes and messages, each after a header with its kind and its length,
    64 bits each, little-endian.
    """
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.truncate(_end_of_messages(file, size))


def _end_of_messages(file: BinaryIO, size: int) -> int:
    end, header = 12, struct.Struct("<QQ")
    while end + header.size <= size:
        file.seek(end)
        _, length = header.unpack(file.read(header.size))
        if end + header.size + length > size:
            break
        end += header.size + length
    return min(end, size)


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("0.0.0.0", port))
        except OSError:
            return False
    return True
