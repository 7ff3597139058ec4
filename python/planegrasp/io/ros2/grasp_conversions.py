"""What a grasp planner says, as messages of trajectory_msgs, geometry_msgs and diagnostic_msgs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.io.messages.grasps import GraspPlanMessage
from planegrasp.io.messages.pose import Pose
from planegrasp.io.ros2.conversions import header_message, pose_message

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planegrasp.io.messages.grasps import GraspRefusalMessage, GraspVerdict
    from planegrasp.io.messages.header import Header
    from planegrasp.io.ros2.transport import MessageTypes

__all__ = ["grasp_pose", "joint_trajectory", "verdicts_array"]

_NO_POSE = Pose((math.nan,) * 3, (math.nan,) * 4)
# Of diagnostic_msgs/DiagnosticStatus.
_OK, _ERROR = 0, 2


def joint_trajectory(
    types: MessageTypes, header: Header, joints: Sequence[str], path: Sequence[Sequence[float]]
) -> Any:
    """trajectory_msgs/JointTrajectory of a path, which has no times: all of them are 0.

    Args:
        types: of messages.
        header: of the plan.
        joints: their names.
        path: joint positions [rad or m], one sequence a point; none for no path.
    """
    point = types("trajectory_msgs/msg/JointTrajectoryPoint")
    nothing = np.zeros(0)
    at_once = types("builtin_interfaces/msg/Duration")(sec=0, nanosec=0)
    return types("trajectory_msgs/msg/JointTrajectory")(
        header=header_message(types, header),
        joint_names=list(joints),
        points=[
            point(
                positions=np.array(positions, np.float64),
                velocities=nothing,
                accelerations=nothing,
                effort=nothing,
                time_from_start=at_once,
            )
            for positions in path
        ],
    )


def grasp_pose(types: MessageTypes, header: Header, pose: Pose | None) -> Any:
    """geometry_msgs/PoseStamped; all of it NaN where there is no pose.

    NaN and not zeros: RViz and tf2 refuse it, where zeros could be taken for the frame's origin.
    """
    return types("geometry_msgs/msg/PoseStamped")(
        header=header_message(types, header), pose=pose_message(types, pose or _NO_POSE)
    )


def verdicts_array(types: MessageTypes, message: GraspPlanMessage | GraspRefusalMessage) -> Any:
    """diagnostic_msgs/DiagnosticArray: first on the object, then on each of its grasps.

    The object's has its name, and the name of the chosen grasp or why there is none. A grasp's is
    named OBJECT/GRASP, its message says why it was refused, its values are the score and the
    figures. What is accepted is OK, what is refused ERROR.
    """
    if isinstance(message, GraspPlanMessage):
        values = {"opening": message.opening, "force": message.force}
        whole = _status(types, message.name, message.grasp, True, values)
    else:
        whole = _status(types, message.name, message.reason, False, {})
    return types("diagnostic_msgs/msg/DiagnosticArray")(
        header=header_message(types, message.header),
        status=[whole, *(_verdict(types, message.name, one) for one in message.verdicts)],
    )


def _verdict(types: MessageTypes, name: str, verdict: GraspVerdict) -> Any:
    values = {"score": verdict.score, **dict(verdict.figures)}
    whole = f"{name}/{verdict.grasp}"
    return _status(types, whole, verdict.reason, verdict.accepted, values)


def _status(
    types: MessageTypes, name: str, text: str, is_well: bool, values: Mapping[str, float]
) -> Any:
    pair = types("diagnostic_msgs/msg/KeyValue")
    return types("diagnostic_msgs/msg/DiagnosticStatus")(
        level=_OK if is_well else _ERROR,
        name=name,
        message=text,
        hardware_id="",
        values=[pair(key=key, value=repr(value)) for key, value in values.items()],
    )
