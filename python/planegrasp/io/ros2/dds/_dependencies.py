"""Import this before anything that needs the extra `ros2`: the error then says what to install."""

from __future__ import annotations

from planegrasp.errors import MissingExtraError

try:
    import cyclonedds.domain  # noqa: F401
except ImportError as error:
    raise MissingExtraError("ROS 2 over DDS", "ros2", str(error)) from error
