"""Ports, and Rerun's own server, which stands for its viewer and needs no display."""

from __future__ import annotations

import socket
import subprocess
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path


def free_port():
    with socket.socket() as probe:
        probe.bind(("0.0.0.0", 0))
        return probe.getsockname()[1]


@contextmanager
def rerun_server(port):
    """It listens; yields its process, which is ended afterwards."""
    program = Path(find_spec("rerun_cli").origin).with_name("rerun")
    with subprocess.Popen(
        [program, "--serve-grpc", "--port", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as server:
        try:
            while not _listens(port):
                assert server.poll() is None
            yield server
        finally:
            server.kill()


def _listens(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
