"""Topics of ROS 2: names, messages and what a live system publishes, by whatever transport.

`planegrasp.io.ros2.dds` is the transport that needs no ROS installation.
"""

from planegrasp.io.ros2.grasp_publisher import GraspPublisher, GraspTopics
from planegrasp.io.ros2.publisher import LivePublisher
from planegrasp.io.ros2.topics import LiveTopics
from planegrasp.io.ros2.transport import MessageTypes, Published, Reader, Transport, Waiting, Writer

__all__ = [
    "GraspPublisher",
    "GraspTopics",
    "LivePublisher",
    "LiveTopics",
    "MessageTypes",
    "Published",
    "Reader",
    "Transport",
    "Waiting",
    "Writer",
]
