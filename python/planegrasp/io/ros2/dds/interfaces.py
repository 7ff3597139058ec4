"""The network interfaces of this computer."""

from __future__ import annotations

import fcntl
import socket
import struct

__all__ = ["interfaces"]

# Of Linux, see netdevice(7).
_GET_FLAGS = 0x8913  # SIOCGIFFLAGS
_REQUEST = "16sH14x"  # struct ifreq: name, flags
_IS_UP = 1  # IFF_UP


def interfaces() -> list[str]:
    """Names of those that are up; where the system does not say so, of all."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        return [name for _, name in socket.if_nameindex() if _is_up(any_socket, name)]


def _is_up(any_socket: socket.socket, name: str) -> bool:
    request = struct.pack(_REQUEST, name.encode(), 0)
    try:
        _, flags = struct.unpack(_REQUEST, fcntl.ioctl(any_socket, _GET_FLAGS, request))
    except OSError:
        return True
    return bool(flags & _IS_UP)
