"""Logs where things are: frames of camera and objects, and the scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foxglove.messages import FrameTransform, FrameTransforms, SceneEntity, SceneUpdate

from planegrasp.io.foxglove.scenes import deletions, grasp_entity, object_entity, placed_objects
from planegrasp.io.foxglove.values import transform
from planegrasp.io.messages.frames import OPTICAL_IN_BODY
from planegrasp.io.messages.grasps import GraspPlanMessage
from planegrasp.io.messages.header import Header
from planegrasp.io.messages.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planegrasp.geometry import RigidTransform
    from planegrasp.io.foxglove.channels import Channels
    from planegrasp.io.messages.frames import FrameIds
    from planegrasp.io.messages.grasps import GraspRefusalMessage
    from planegrasp.io.messages.objects import DetectionsMessage, TracksMessage
    from planegrasp.viz.palette import RGB

__all__ = ["Space"]


class Space:
    """Logs objects that are seen, and deletes those that are not.

    Args:
        channels: to log in.
        ids: names of frames.
        colors: by object name.
    """

    def __init__(self, channels: Channels, ids: FrameIds, colors: Mapping[str, RGB]) -> None:
        self._channels, self._ids, self._colors = channels, ids, colors
        self._shown: frozenset[str] = frozenset()
        self._grasps: dict[str, SceneEntity] = {}

    def log(
        self,
        detections: DetectionsMessage,
        tracks: TracksMessage | None = None,
        body_frame: str = "",
        T_fixed_camera: RigidTransform | None = None,
    ) -> None:
        """Log what is known after a frame.

        All transforms, and the grasps that hold, come with every frame: whoever connects late, or
        looks at a part of a file, has them.

        Args:
            detections: of the frame.
            tracks: after it; where there are some, theirs are the poses that count.
            body_frame: of the camera, the parent of its optical frame; "" for none.
            T_fixed_camera: pose of the camera in `FrameIds.fixed`, where it moves.
        """
        header, placed = placed_objects(self._ids, detections, tracks)
        time = header.stamp.total_nanoseconds
        transforms = self._camera(detections.header, body_frame, T_fixed_camera)
        transforms += [transform(header, one.frame_id, one.pose) for one in placed]
        self._channels.transforms.log(FrameTransforms(transforms=transforms), log_time=time)
        shown = frozenset(one.frame_id for one in placed)
        update = SceneUpdate(
            deletions=deletions(header.stamp, self._shown - shown),
            entities=[object_entity(header, one, self._colors) for one in placed],
        )
        self._channels.scene.log(update, log_time=time)
        self._shown = shown
        if self._grasps:
            held = SceneUpdate(entities=list(self._grasps.values()))
            self._channels.grasp_scene.log(held, log_time=time)

    def grasp(self, message: GraspPlanMessage | GraspRefusalMessage) -> None:
        """Log the gripper where a plan puts it, from now on; after a refusal there is none."""
        entity = f"grasps/{message.name}"
        if isinstance(message, GraspPlanMessage):
            planned = grasp_entity(message, entity, self._colors)
            self._grasps[message.name] = planned
            update = SceneUpdate(entities=[planned])
        else:
            self._grasps.pop(message.name, None)
            update = SceneUpdate(deletions=deletions(message.header.stamp, [entity]))
        time = message.header.stamp.total_nanoseconds
        self._channels.grasp_scene.log(update, log_time=time)

    def _camera(
        self, header: Header, body_frame: str, T_fixed_camera: RigidTransform | None
    ) -> list[FrameTransform]:
        """From the fixed frame to the body, from there to the optical one: each has one parent."""
        transforms, top, T_fixed_top = [], header.frame_id, T_fixed_camera
        if body_frame:
            body = Header(header.stamp, body_frame)
            transforms.append(transform(body, header.frame_id, Pose.of(OPTICAL_IN_BODY)))
            top = body_frame
            if T_fixed_camera is not None:
                T_fixed_top = T_fixed_camera * OPTICAL_IN_BODY.inv()
        if T_fixed_top is not None and self._ids.fixed:
            fixed = Header(header.stamp, self._ids.fixed)
            transforms.append(transform(fixed, top, Pose.of(T_fixed_top)))
        return transforms
