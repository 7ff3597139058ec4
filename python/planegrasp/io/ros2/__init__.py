"""ROS 2 without a ROS installation: its topics, types and quality of service over DDS."""

from planegrasp.io.ros2.node import DdsConfig, DdsNode, Published, Reader, Writer
from planegrasp.io.ros2.publisher import LivePublisher
from planegrasp.io.ros2.topics import LiveTopics
from planegrasp.io.ros2.types import dds_type

__all__ = [
    "DdsConfig",
    "DdsNode",
    "LivePublisher",
    "LiveTopics",
    "Published",
    "Reader",
    "Writer",
    "dds_type",
]
