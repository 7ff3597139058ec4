"""A WebSocket server that the Foxglove app connects to."""

from __future__ import annotations

import ipaddress
import re
import socket
from typing import NamedTuple

import foxglove

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import InvalidInputError, ViewerError

__all__ = ["HOST", "PORT", "FoxgloveServer", "ServerAddress"]

HOST, PORT = "127.0.0.1", 8765
"""Where the Foxglove app looks by itself."""

_BACKLOG = 128  # messages that wait for a slow client: a dozen frames, some 20 MB

_LAST_PORT = 65535
_ADDRESS = re.compile(r"(\[(?P<ipv6>[^]]*:[^]]*)\]|(?P<name>[^][:\s]*))(:(?P<port>[0-9]{1,5}))?")


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
        """HOST:PORT, HOST, :PORT, PORT or nothing; an IPv6 address before a port is in brackets.

        Raises:
            InvalidInputError: it is none of these.
        """
        if _ip(text) is not None:
            return cls(text)
        if text.isdecimal():
            text = f":{text}"
        parts = _ADDRESS.fullmatch(text)
        is_address = parts is not None and (parts["ipv6"] is None or _ip(parts["ipv6"]) is not None)
        if parts is None or not is_address or int(parts["port"] or 0) > _LAST_PORT:
            raise InvalidInputError(
                f"an address is HOST:PORT with a port from 0 to {_LAST_PORT}, for example "
                f"{HOST}:{PORT} or [::1]:{PORT}, got {text!r}"
            )
        return cls(parts["ipv6"] or parts["name"] or HOST, int(parts["port"] or PORT))

    @property
    def is_on_network(self) -> bool:
        """Whether others than this computer can connect."""
        ip = _ip(self.host)
        return self.host != "localhost" if ip is None else not ip.is_loopback


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
        """What to give the Foxglove app; this computer's name where it listens at any address."""
        host, port = self.address
        ip = _ip(host)
        if ip is not None and ip.is_unspecified:
            host = socket.gethostname()
        return f"ws://[{host}]:{port}" if ":" in host else f"ws://{host}:{port}"

    def close(self) -> None:
        """End all connections."""
        if not self._is_closed:
            self._is_closed = True
            self._server.stop()


def _ip(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """The address; None for a host that has a name."""
    try:
        return ipaddress.ip_address(text)
    except ValueError:
        return None
