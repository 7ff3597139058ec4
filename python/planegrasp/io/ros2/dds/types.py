"""DDS types of ROS messages by their ROS names."""

from __future__ import annotations

from typing import Any

from planegrasp.errors import InvalidInputError
from planegrasp.io.ros2.dds import (
    _dependencies,  # noqa: F401
    idl_common,
    idl_grasps,
    idl_images,
    idl_results,
)

__all__ = ["dds_type", "ros_name"]


def ros_name(dds_name: str) -> str:
    """``package/msg/Name`` of a DDS type's ``package::msg::dds_::Name_``; others as they are."""
    parts = dds_name.split("::")
    if len(parts) != 4 or parts[2] != "dds_" or not parts[3].endswith("_"):
        return dds_name
    return f"{parts[0]}/{parts[1]}/{parts[3][:-1]}"


def _is_message(name: str, kind: object) -> bool:
    return hasattr(kind, "__idl_typename__") and not name.startswith("_")


_TYPES: dict[str, Any] = {
    ros_name(kind.__idl_typename__): kind
    for module in (idl_common, idl_images, idl_results, idl_grasps)
    for name, kind in vars(module).items()
    if getattr(kind, "__module__", "") == module.__name__ and _is_message(name, kind)
}


def dds_type(name: str) -> Any:
    """The DDS type of a message, for example ``geometry_msgs/msg/Pose``.

    Raises:
        InvalidInputError: there is none of that name.
    """
    try:
        return _TYPES[name]
    except KeyError:
        known = ", ".join(sorted(_TYPES))
        raise InvalidInputError(f"no message is named {name!r}; there are {known}") from None
