"""Quality of service as ROS 2 has it by default (rmw/qos_profiles.h, tf2_ros/qos.hpp)."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["DEFAULT", "KEPT", "LATEST", "OVERLAY", "SENSOR", "TF", "TF_STATIC", "Profile"]


@dataclass(frozen=True, slots=True)
class Profile:
    """What a writer offers or a reader asks for.

    Attributes:
        depth: how many messages are kept.
        reliable: whether what was lost on the way is sent again; a reader that asks for this gets
            nothing from a writer that does not offer it.
        keeps: whether readers that come later get what is kept (ROS: transient local).
    """

    depth: int = 10
    reliable: bool = True
    keeps: bool = False


DEFAULT = Profile()
SENSOR = Profile(depth=5, reliable=False)
TF = Profile(depth=100)
TF_STATIC = Profile(depth=1, keeps=True)
KEPT = Profile(depth=10, keeps=True)
"""For what late comers need: events."""
LATEST = Profile(depth=1, keeps=True)
"""For what holds until the next one: plans."""
OVERLAY = Profile(depth=2)
"""For large images of which only the newest matters."""
