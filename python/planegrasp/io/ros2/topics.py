"""Names of what planegrasp publishes and listens to."""

from __future__ import annotations

from dataclasses import dataclass

from planegrasp.io.ros2.names import check_topic

__all__ = ["LiveTopics"]


@dataclass(frozen=True, slots=True)
class LiveTopics:
    """Topics of a live system.

    Attributes:
        namespace: before all names but those of tf.

    Raises:
        InvalidInputError: no topic can begin so.
    """

    namespace: str = "/planegrasp"

    def __post_init__(self) -> None:
        check_topic(self.namespace)

    @property
    def detections(self) -> str:
        """vision_msgs/Detection3DArray of every frame."""
        return f"{self.namespace}/detections"

    def pose(self, part: str, instance: int = 0) -> str:
        """geometry_msgs/PoseWithCovarianceStamped of one object where it is seen.

        Args:
            part: of the topic's name that stands for the object, see `topic_parts`.
            instance: of the object.
        """
        further = f"/instance_{instance}" if instance else ""
        return f"{self.namespace}/objects/{part}{further}/pose"

    @property
    def overlay(self) -> str:
        """sensor_msgs/Image with what was found drawn into it."""
        return f"{self.namespace}/overlay"

    @property
    def markers(self) -> str:
        """visualization_msgs/MarkerArray for RViz."""
        return f"{self.namespace}/markers"

    @property
    def events(self) -> str:
        """std_msgs/String with JSON: what happened to library, camera and task."""
        return f"{self.namespace}/events"

    @property
    def task(self) -> str:
        """std_msgs/String with JSON that is listened to, see `task_from_json`."""
        return f"{self.namespace}/task"
