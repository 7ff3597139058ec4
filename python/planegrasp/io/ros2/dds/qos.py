"""Quality of service in DDS, as rmw_cyclonedds makes it of that of ROS 2."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.io.ros2.dds import _dependencies  # noqa: F401

from cyclonedds.qos import Policy, Qos  # isort: skip
from cyclonedds.util import duration  # isort: skip

if TYPE_CHECKING:
    from planegrasp.io.ros2.profiles import Profile

__all__ = ["reader_qos", "writer_qos"]

# A reader that was killed is missed only after some seconds. ROS 2 lets writers wait for it.
_BLOCKING = 0.005  # [s]
_UNLIMITED = -1


def writer_qos(profile: Profile) -> Qos:
    """For a writer."""
    # For those that come later as much is kept as for the others; by default it is one message.
    kept = Policy.DurabilityService(
        cleanup_delay=0,
        history=Policy.History.KeepLast(profile.depth),
        max_samples=_UNLIMITED,
        max_instances=_UNLIMITED,
        max_samples_per_instance=_UNLIMITED,
    )
    return Qos(*_common(profile), kept, Policy.WriterDataLifecycle(autodispose=False))


def reader_qos(profile: Profile) -> Qos:
    """For a reader."""
    return Qos(*_common(profile))


def _common(profile: Profile) -> tuple[object, ...]:
    reliable = Policy.Reliability.Reliable(max_blocking_time=duration(seconds=_BLOCKING))
    return (
        reliable if profile.reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if profile.keeps else Policy.Durability.Volatile,
        Policy.History.KeepLast(profile.depth),
        # ROS 2 writes plain CDR, the first version of it.
        Policy.DataRepresentation(use_cdrv0_representation=True),
    )
