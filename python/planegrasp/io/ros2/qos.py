"""Quality of service as ROS 2 has it by default (rmw/qos_profiles.h, tf2_ros/qos.hpp)."""

from __future__ import annotations

from dataclasses import dataclass

from planegrasp.io.ros2 import _dependencies  # noqa: F401

from cyclonedds.qos import Policy, Qos  # isort: skip
from cyclonedds.util import duration  # isort: skip

__all__ = ["DEFAULT", "KEPT", "SENSOR", "TF", "TF_STATIC", "Profile"]

# A reader that was killed is missed only after some seconds. ROS 2 lets writers wait for it.
_BLOCKING = 0.005  # [s]
_UNLIMITED = -1


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

    def of_writer(self) -> Qos:
        """For a writer."""
        # For those that come later as much is kept as for the others; by default it is one message.
        kept = Policy.DurabilityService(
            cleanup_delay=0,
            history=Policy.History.KeepLast(self.depth),
            max_samples=_UNLIMITED,
            max_instances=_UNLIMITED,
            max_samples_per_instance=_UNLIMITED,
        )
        return Qos(*self._common(), kept, Policy.WriterDataLifecycle(autodispose=False))

    def of_reader(self) -> Qos:
        """For a reader."""
        return Qos(*self._common())

    def _common(self) -> tuple[object, ...]:
        reliable = Policy.Reliability.Reliable(max_blocking_time=duration(seconds=_BLOCKING))
        return (
            reliable if self.reliable else Policy.Reliability.BestEffort,
            Policy.Durability.TransientLocal if self.keeps else Policy.Durability.Volatile,
            Policy.History.KeepLast(self.depth),
            # ROS 2 writes plain CDR, the first version of it.
            Policy.DataRepresentation(use_cdrv0_representation=True),
        )


DEFAULT = Profile()
SENSOR = Profile(depth=5, reliable=False)
TF = Profile(depth=100)
TF_STATIC = Profile(depth=1, keeps=True)
KEPT = Profile(depth=10, keeps=True)
"""For what late comers need: events."""
