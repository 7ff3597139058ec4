"""Which DDS domain, on which network."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["DdsConfig"]

_LARGEST_DOMAIN = 232
# A reader that does not keep up or was killed must not hold a writer up: there is room for what it
# has not got. What is older than the depth of a topic's history goes anyway.
_ROOM = "64 MB"
# Images come in bursts, and the thread that takes them may be late. The system gives at most its
# net.core.rmem_max.
_BUFFER = "8 MB"


@dataclass(frozen=True, slots=True)
class DdsConfig:
    """Which DDS domain, on which network.

    Attributes:
        domain: number of the domain, 0 … 232; the others on the same network have the same
            (`ROS_DOMAIN_ID`).
        network: "" keeps everything on this computer (the loopback interface); "auto" takes the
            network interface that Cyclone DDS chooses, or all that `CYCLONEDDS_URI` configures;
            else the name of one, for example "eth0".

    Raises:
        InvalidInputError: the domain is out of range, or the network no name.
    """

    domain: int = 0
    network: str = ""

    def __post_init__(self) -> None:
        if not 0 <= self.domain <= _LARGEST_DOMAIN:
            raise InvalidInputError(
                f"the number of a domain is 0 … {_LARGEST_DOMAIN}, got {self.domain}"
            )
        if any(character in self.network for character in "<>&\"'/ "):
            raise InvalidInputError(f"no network interface is named {self.network!r}")

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] | None = None) -> Self:
        """As ROS 2 would have it by `ROS_DOMAIN_ID` and `ROS_AUTOMATIC_DISCOVERY_RANGE`.

        Only the range SUBNET, said in so many words, leads onto the network.

        Raises:
            InvalidInputError: `ROS_DOMAIN_ID` is no number of a domain.
        """
        variables = os.environ if environment is None else environment
        text = variables.get("ROS_DOMAIN_ID", "") or "0"
        if not text.isdecimal():
            raise InvalidInputError(f"ROS_DOMAIN_ID must be a number, got {text!r}")
        is_wide = variables.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper() == "SUBNET"
        return cls(int(text), "auto" if is_wide else "")

    @property
    def xml(self) -> str | None:
        """Configuration of Cyclone DDS; None leaves it to `CYCLONEDDS_URI`."""
        if self.network == "auto" and os.environ.get("CYCLONEDDS_URI"):
            return None
        if self.network == "auto":
            interface, discovery, sizes = 'autodetermine="true"', "", ""
        elif self.network:
            interface, discovery, sizes = f'name="{self.network}"', "", ""
        else:
            # Linux' loopback can do multicast, but does not say so. Peers that do not use it there
            # are found by the ports of the first participants.
            interface = 'address="127.0.0.1" multicast="true"'
            # Its packets are large: images come through in few.
            sizes = "<MaxMessageSize>65000 B</MaxMessageSize><FragmentSize>60000 B</FragmentSize>"
            discovery = (
                "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
                "<MaxAutoParticipantIndex>99</MaxAutoParticipantIndex>"
                '<Peers><Peer address="127.0.0.1"/></Peers></Discovery>'
            )
        return (
            "<CycloneDDS><Domain><General><Interfaces>"
            f"<NetworkInterface {interface}/></Interfaces>{sizes}</General>{discovery}"
            f"<Internal><Watermarks><WhcHigh>{_ROOM}</WhcHigh></Watermarks>"
            f'<SocketReceiveBufferSize max="{_BUFFER}"/></Internal>'
            "<Tracing><Verbosity>none</Verbosity></Tracing></Domain></CycloneDDS>"
        )
