"""Where live data for Rerun goes: a file, a viewer, a browser; and what happens when that ends.

Rerun writes and sends in threads of its own, and reports what failed only when it is asked to
flush. So a stream is flushed now and then, and a failure becomes an exception here.
"""

from __future__ import annotations

import os
import socket
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import quote

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import RecordingError, ViewerError
from planegrasp.viz.rerun_file import RrdFile
from planegrasp.viz.rerun_parts import rerun

__all__ = ["GRPC_PORT", "WEB_PORT", "RerunStream", "to_browser", "to_file", "to_viewer"]

GRPC_PORT = 9876
"""At which a viewer is sent its data."""
WEB_PORT = 9090
"""At which a browser finds the viewer."""

# A flush that takes longer means that nobody takes the data [s].
_PATIENCE = 10.0
# How often a stream is asked whether it still works [s].
_CHECK_EVERY = 0.5
_WITHOUT = ": --web shows it in a browser, --rrd writes a file"


class RerunStream(ClosesAtEnd):
    """A Rerun stream that says when it ends; a context manager.

    Attributes:
        stream: Rerun's `RecordingStream`.
        url: where a browser finds it, "" for none.
    """

    def __init__(
        self, stream: Any, target: str, file: RrdFile | None = None, url: str = ""
    ) -> None:
        """Take over a stream.

        Args:
            stream: of Rerun, with a sink.
            target: what to call it in errors.
            file: that it goes to, where it does.
            url: for a browser.
        """
        self.stream = stream
        self.url = url
        self._target, self._file = target, file
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
            raise ViewerError(f"{self._target} takes no data any more: {error}") from error
        self._check_file()

    def close(self) -> None:
        """Hand over what is left, and end; raises as `check` does."""
        try:
            if not self._has_failed:
                self.flush()
        finally:
            self.stream.disconnect()
            if self._file is not None:
                self._file.finish()
        if not self._has_failed:
            self._check_file()

    def _check_file(self) -> None:
        if self._file is None or self._file.error is None:
            return
        self._has_failed = True
        error = self._file.error
        raise RecordingError(
            f"{self._target} cannot be written any further: {error.strerror}; what was written "
            f"before can be read"
        ) from error


def to_file(path: str | Path, blueprint: Any) -> RerunStream:
    """Into a new .rrd file.

    Raises:
        RecordingError: it exists already, or cannot be written.
        MissingExtraError: rerun-sdk is not installed.
    """
    rr = rerun()
    file = RrdFile(Path(path))
    stream = rr.RecordingStream("planegrasp")
    stream.save(file.entrance, default_blueprint=blueprint)
    file.entered()
    return RerunStream(stream, str(path), file)


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
            _check_display()
            rr.spawn(
                port=port,
                memory_limit=memory,
                connect=False,
                hide_welcome_screen=True,
                executable_path=_viewer_program(),
                recording=stream,
            )
            _wait_until_taken(port)
        stream.connect_grpc(f"rerun+http://127.0.0.1:{port}/proxy", default_blueprint=blueprint)
        stream.flush(timeout_sec=_PATIENCE)
    except RuntimeError as error:
        reason = str(error).strip().partition("\n")[0]
        reason = str(error).strip().partition("\n")[0]
        raise ViewerError(
            f"the Rerun viewer does not start, or what listens at port {port} is none "
            f"({reason}){_WITHOUT}"
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


def _viewer_program() -> str | None:
    """The viewer that rerun-sdk brings, which need not be on the PATH."""
    package = find_spec("rerun_cli")
    if package is None or package.origin is None:
        return None
    program = Path(package.origin).with_name("rerun")
    return str(program) if program.exists() else None


def _check_display() -> None:
    """Say at once what the viewer would say only to itself."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
    if sys.platform == "linux" and not any(os.environ.get(name) for name in names):
        raise ViewerError(f"there is no display for the Rerun viewer{_WITHOUT}")


def _wait_until_taken(port: int) -> None:
    end = time.monotonic() + _PATIENCE
    while _is_free(port):
        if time.monotonic() > end:
            raise ViewerError(f"the Rerun viewer does not start{_WITHOUT}")
        time.sleep(0.05)


def _is_free(port: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("0.0.0.0", port))
        except OSError:
            return False
    return True
