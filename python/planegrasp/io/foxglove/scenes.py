"""Objects and planned grasps in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from foxglove.messages import (
    CubePrimitive,
    Duration,
    KeyValuePair,
    LinePrimitive,
    LinePrimitiveLineType,
    SceneEntity,
    SceneEntityDeletion,
    SceneEntityDeletionType,
    TextPrimitive,
)

from planegrasp.io.foxglove.values import (
    IDENTITY,
    color_message,
    points,
    pose_message,
    timestamp,
    vector,
)
from planegrasp.io.messages.pose import Pose
from planegrasp.io.ros2.conversions import box_pose
from planegrasp.viz.gripper import gripper_lines
from planegrasp.viz.palette import AXIS_COLORS, color_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planegrasp.io.messages.frames import FrameIds
    from planegrasp.io.messages.grasps import GraspPlanMessage
    from planegrasp.io.messages.header import Header, Stamp
    from planegrasp.io.messages.objects import (
        DetectedObject,
        DetectionsMessage,
        TrackedObject,
        TracksMessage,
    )
    from planegrasp.viz.palette import RGB

__all__ = ["PlacedObject", "deletions", "grasp_entity", "object_entity", "placed_objects"]

_LINE, _TEXT = 0.004, 0.03  # [m]
_SHOWN_FOR = 1  # so long without news [s], for example after a kill


@dataclass(frozen=True, slots=True)
class PlacedObject:
    """An object that is seen, and where.

    Attributes:
        frame_id: what its own frame is called.
        pose: in the frame of the header.
        seen: as the message has it.
    """

    frame_id: str
    pose: Pose
    seen: DetectedObject | TrackedObject


def placed_objects(
    ids: FrameIds, detections: DetectionsMessage, tracks: TracksMessage | None
) -> tuple[Header, tuple[PlacedObject, ...]]:
    """Where the objects are: by the tracks where there are some, else by the detections.

    Returns:
        The header whose frame they are in, and those that are seen and have a pose.
    """
    if tracks is not None:
        return tracks.header, tuple(
            PlacedObject(ids.object(one.name, one.instance), one.pose.pose, one)
            for one in tracks.objects
            if one.seen
        )
    return detections.header, tuple(
        PlacedObject(ids.object(one.name, one.instance), one.pose.pose, one)
        for one in detections.objects
        if one.pose is not None
    )


def object_entity(
    header: Header, placed: PlacedObject, colors: Mapping[str, RGB] | None = None
) -> SceneEntity:
    """An object's box, its axes and its name."""
    seen, T = placed.seen, placed.pose.T
    color = color_of(seen.name, colors)
    length = sorted(seen.box.size)[1] / 2
    tips = np.asarray(T.apply(length * np.eye(3)))
    ends = [end for tip in tips for end in (T.translation, tip)]
    x, y, z = T.apply([0.0, seen.box.size[1] / 2 + _TEXT, 0.0]).tolist()
    return SceneEntity(
        timestamp=timestamp(header.stamp),
        frame_id=header.frame_id,
        id=placed.frame_id,
        lifetime=Duration(_SHOWN_FOR),
        metadata=[
            KeyValuePair(key="name", value=seen.name),
            KeyValuePair(key="instance", value=str(seen.instance)),
        ],
        cubes=[
            CubePrimitive(
                pose=pose_message(box_pose(placed.pose, seen)),
                size=vector(seen.box.size),
                color=color_message(color, 0.5),
            )
        ],
        lines=[
            LinePrimitive(
                type=LinePrimitiveLineType.LineList,
                pose=pose_message(IDENTITY),
                thickness=_LINE,
                points=points(ends),
                colors=[color_message(axis) for axis in AXIS_COLORS for _ in range(2)],
            )
        ],
        texts=[
            TextPrimitive(
                pose=pose_message(Pose((x, y, z), IDENTITY.orientation)),
                billboard=True,
                font_size=_TEXT,
                color=color_message(color),
                text=seen.name + (f" #{seen.instance}" if seen.instance else ""),
            )
        ],
    )


def grasp_entity(
    plan: GraspPlanMessage, entity: str, colors: Mapping[str, RGB] | None = None
) -> SceneEntity:
    """The gripper at the grasp, paler before it, and the way between."""
    header, color = plan.header, color_of(plan.name, colors)
    grippers = [
        LinePrimitive(
            type=LinePrimitiveLineType.LineStrip,
            pose=pose_message(pose),
            thickness=_LINE,
            points=points(line),
            color=color_message(color, alpha),
        )
        for pose, alpha in ((plan.gripper_pose, 1.0), (plan.pregrasp_pose, 0.4))
        for line in gripper_lines(plan.opening)
    ]
    way = LinePrimitive(
        type=LinePrimitiveLineType.LineStrip,
        pose=pose_message(IDENTITY),
        thickness=_LINE / 2,
        points=points([plan.pregrasp_pose.position, plan.gripper_pose.position]),
        color=color_message(color, 0.6),
    )
    return SceneEntity(
        timestamp=timestamp(header.stamp),
        frame_id=header.frame_id,
        id=entity,
        metadata=[KeyValuePair(key="grasp", value=plan.grasp)],
        lines=[*grippers, way],
    )


def deletions(stamp: Stamp, gone: Iterable[str]) -> list[SceneEntityDeletion]:
    """Of entities that are not shown any more."""
    kind = SceneEntityDeletionType.MatchingId
    return [
        SceneEntityDeletion(timestamp=timestamp(stamp), type=kind, id=one) for one in sorted(gone)
    ]
