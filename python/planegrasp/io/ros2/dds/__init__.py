"""ROS 2 without a ROS installation: its types and quality of service over DDS."""

from planegrasp.io.ros2.dds.config import DdsConfig
from planegrasp.io.ros2.dds.node import DdsNode, DdsReader, DdsWriter
from planegrasp.io.ros2.dds.types import dds_type

__all__ = ["DdsConfig", "DdsNode", "DdsReader", "DdsWriter", "dds_type"]
