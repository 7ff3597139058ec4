"""Names of ROS topics, in ROS and in DDS."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["check_topic", "dds_topic", "ros_topic", "topic_parts"]

_TOPIC = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_PREFIX = "rt"  # of what ROS 2 publishes as topics in DDS


def check_topic(topic: str) -> str:
    """Return the name of a topic if ROS 2 takes it as a full name.

    Raises:
        InvalidInputError: it does not begin with a slash, or has other than letters, digits and
            underscores between slashes, or a part that begins with a digit.
    """
    if not _TOPIC.fullmatch(topic) or "__" in topic:
        raise InvalidInputError(
            f"{topic!r} is no name of a ROS topic: use for example /camera/color/image_raw, of "
            f"letters, digits and single underscores, no part beginning with a digit"
        )
    return topic


def dds_topic(topic: str) -> str:
    """What a ROS topic is called in DDS."""
    return _PREFIX + check_topic(topic)


def ros_topic(dds_name: str) -> str | None:
    """The ROS topic of a DDS topic, None where it is none."""
    return dds_name[len(_PREFIX) :] if dds_name.startswith(_PREFIX + "/") else None


def topic_parts(names: Iterable[str]) -> dict[str, str]:
    """A part of a topic's name for each name of an object, no two the same.

    Objects' names may have what ROS does not allow: that becomes an underscore, and of names that
    are the same then, later ones get a number.
    """
    parts: dict[str, str] = {}
    for name in sorted(set(names)):
        base = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_") or "object"
        base = f"object_{base}" if base[0].isdigit() else base
        part, number = base, 2
        while part in parts.values():
            part, number = f"{base}_{number}", number + 1
        parts[name] = part
    return parts
