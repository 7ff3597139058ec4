"""A WebSocket server that the Foxglove app connects to."""

from __future__ import annotations

import ipaddress
from typing import NamedTuple

import foxglove

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import InvalidInputError, ViewerError

__all__ = ["HOST", "PORT", "FoxgloveServer", "ServerAddress"]

HOST, PORT = "127.0.0.1", 8765
"""Where the Foxglove app looks by itself."""

_BACKLOG = 128  # messages that wait for a slow client: a dozen frames, some 20 MB


class ServerAddress(NamedTuple):
    """Where to listen.

    Attributes:
        host: address of a network interface of this computer; by default nobody else can connect.
        port: 0 for any that is free.
    """

    host: str = HOST
    port: int = PORT

    @classmethod
    def parsed(cls, text: str) -> ServerAddress:
        """HOST:PORT, HOST, :PORT, PORT or nothing; brackets are around an IPv6 address with a port.

        Raises:
            InvalidInputError: it is none of these.
        """
        host, colon, port = text.rpartition(":")
        if not colon and text.isdecimal():
            host, port = "", text
        elif not colon or (":" in host and not host.startswith("[")):
            host, port = text, ""
        if (port and not (port.isdecimal() and int(port) <= 65535)) or text.endswith(":"):
            raise InvalidInputError(
                f"an address is HOST:PORT with a port from 0 to 65535, for example "
                f"{HOST}:{PORT}, got {text!r}"
            )
        return cls(host.strip("[]") or HOST, int(port) if port else PORT)

    @property
    def is_on_network(self) -> bool:
        """Whether others than this computer can connect."""
        try:
            return not ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host != "localhost"


class FoxgloveServer(ClosesAtEnd):
    """Serves what is logged in a context to any number of clients; a context manager.

    A client that is too slow misses the oldest messages; nobody waits for it.

    Attributes:
        address: where it listens.
    """

    def __init__(self, context: foxglove.Context, address: ServerAddress | None = None) -> None:
        """Begin to listen.

        Args:
            context: whose channels are served.
            address: where to listen; loopback by default.

        Raises:
            ViewerError: the port is taken, or the host is no address of this computer.
        """
        host, port = address or ServerAddress()
        try:
            self._server = foxglove.start_server(
                name="planegrasp",
                host=host,
                port=port,
                context=context,
                message_backlog_size=_BACKLOG,
            )
        except RuntimeError as error:
            reason = str(error).removeprefix("FoxgloveError: Failed to bind port: ")
            raise ViewerError(
                f"Foxglove cannot be served at {host}:{port} ({reason}): give a free port of "
                f"an address of this computer, for example {HOST}:{port + 1 if port else PORT}"
            ) from error
        self.address = ServerAddress(host, self._server.port)
        self._is_closed = False

    @property
    def url(self) -> str:
        """What to give the Foxglove app."""
        host, port = self.address
        return f"ws://[{host}]:{port}" if ":" in host else f"ws://{host}:{port}"

    def close(self) -> None:
        """End all connections."""
        if not self._is_closed:
            self._is_closed = True
            self._server.stop()
