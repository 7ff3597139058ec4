"""Publishes what a grasp planner says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from planegrasp.closing import ClosesAtEnd
from planegrasp.io.messages.grasps import GraspPlanMessage
from planegrasp.io.ros2.grasp_conversions import grasp_pose, joint_trajectory, verdicts_array
from planegrasp.io.ros2.names import check_topic
from planegrasp.io.ros2.profiles import LATEST

if TYPE_CHECKING:
    from planegrasp.io.messages.grasps import GraspRefusalMessage
    from planegrasp.io.ros2.transport import Transport

__all__ = ["GraspPublisher", "GraspTopics"]

_PATHS = ("move", "reach", "lift")
# Names of poses in topics and in the message of a plan.
_POSES = {"pregrasp": "pregrasp_pose", "grasp": "gripper_pose", "object": "object_pose"}


@dataclass(frozen=True, slots=True)
class GraspTopics:
    """Topics of a grasp planner.

    Attributes:
        namespace: before all names.

    Raises:
        InvalidInputError: no topic can begin so.
    """

    namespace: str = "/planegrasp/grasp"

    def __post_init__(self) -> None:
        check_topic(self.namespace)

    def path(self, part: str) -> str:
        """trajectory_msgs/JointTrajectory of the plan's "move", "reach" or "lift"."""
        return f"{self.namespace}/{part}"

    def pose(self, part: str) -> str:
        """geometry_msgs/PoseStamped of "object", or of the gripper at the "pregrasp" or "grasp"."""
        return f"{self.namespace}/{part}_pose"

    @property
    def verdicts(self) -> str:
        """diagnostic_msgs/DiagnosticArray on the object and on each of its grasps."""
        return f"{self.namespace}/verdicts"


class GraspPublisher(ClosesAtEnd):
    """Publishes plans and refusals on the topics of `GraspTopics`.

    Each topic keeps its last message for those that come later. A refusal empties the paths and
    makes the poses NaN: nobody is left with the plan before. All messages of one answer have the
    same header, by which they belong together.
    """

    def __init__(self, node: Transport, topics: GraspTopics | None = None) -> None:
        """Announce the topics.

        Args:
            node: to publish with.
            topics: their names.
        """
        topics = topics or GraspTopics()
        self._node = node
        self._paths = {
            part: node.writer(topics.path(part), "trajectory_msgs/msg/JointTrajectory", LATEST)
            for part in _PATHS
        }
        self._poses = {
            part: node.writer(topics.pose(part), "geometry_msgs/msg/PoseStamped", LATEST)
            for part in _POSES
        }
        self._verdicts = node.writer(topics.verdicts, "diagnostic_msgs/msg/DiagnosticArray", LATEST)

    def publish(self, message: GraspPlanMessage | GraspRefusalMessage) -> None:
        """Publish what `grasp_message` made of a planner's answer."""
        types, header = self._node.types, message.header
        plan = message if isinstance(message, GraspPlanMessage) else None
        for part, writer in self._paths.items():
            joints, path = (plan.joints, getattr(plan, part)) if plan else ((), ())
            writer.write(joint_trajectory(types, header, joints, path))
        for part, writer in self._poses.items():
            pose = getattr(plan, _POSES[part]) if plan else None
            writer.write(grasp_pose(types, header, pose))
        self._verdicts.write(verdicts_array(types, message))

    def close(self) -> None:
        """End what was announced."""
        for writer in (*self._paths.values(), *self._poses.values(), self._verdicts):
            writer.close()
