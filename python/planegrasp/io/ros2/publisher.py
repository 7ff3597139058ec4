"""Publishes what a live system sees."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

from planegrasp.closing import ClosesAtEnd
from planegrasp.io.messages.frames import OPTICAL_IN_BODY, FrameIds
from planegrasp.io.messages.header import Header, Stamp
from planegrasp.io.messages.live_messages import live_detections, live_tracks
from planegrasp.io.messages.pose import Pose
from planegrasp.io.ros2.conversions import (
    detection3d_array,
    image_message,
    pose_stamped,
    tf_message,
)
from planegrasp.io.ros2.markers import marker_array
from planegrasp.io.ros2.names import topic_parts
from planegrasp.io.ros2.profiles import KEPT, OVERLAY, TF, TF_STATIC
from planegrasp.io.ros2.topics import LiveTopics
from planegrasp.viz.overlay import draw_detections
from planegrasp.viz.palette import object_colors

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planegrasp.io.messages.library import LibraryEvent
    from planegrasp.io.messages.objects import TracksMessage
    from planegrasp.io.ros2.transport import Transport, Writer
    from planegrasp.live import LiveFrame
    from planegrasp.objects import ObjectModel

__all__ = ["LivePublisher"]

_POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
_TF = "tf2_msgs/msg/TFMessage"


class LivePublisher(ClosesAtEnd):
    """Publishes live frames as ROS 2 messages, on the topics of `LiveTopics`, /tf and /tf_static.

    Only what is seen in a frame gets a pose and a transform. What nobody reads is not made.
    """

    def __init__(
        self,
        node: Transport,
        models: Iterable[ObjectModel],
        ids: FrameIds | None = None,
        topics: LiveTopics | None = None,
        body_frame: str = "",
    ) -> None:
        """Announce the topics.

        Args:
            node: to publish with.
            models: all objects that may be seen; each has its topic from the start.
            ids: names of frames.
            topics: names of topics.
            body_frame: publish the camera's body frame (x forward, y left, z up) of that name as
                the parent of its optical frame; "" where the camera's driver does that.

        Raises:
            InvalidInputError: a topic's name is none for ROS.
        """
        names = [model.name for model in models]
        self._node = node
        self._ids = ids or FrameIds()
        self._topics = topics or LiveTopics()
        self._parts = topic_parts(names)
        self._colors = object_colors(names)
        self._detections = node.writer(self._topics.detections, "vision_msgs/msg/Detection3DArray")
        self._markers = node.writer(self._topics.markers, "visualization_msgs/msg/MarkerArray")
        self._overlay = node.writer(self._topics.overlay, "sensor_msgs/msg/Image", OVERLAY)
        self._events = node.writer(self._topics.events, "std_msgs/msg/String", KEPT)
        self._tf = node.writer("/tf", _TF, TF)
        self._poses = {(name, 0): self._pose_writer(name, 0) for name in names}
        self._static: Writer | None = None
        if body_frame:
            self._static = node.writer("/tf_static", _TF, TF_STATIC)
            header = Header(Stamp(), body_frame)
            transforms = [(header, self._ids.camera, Pose.of(OPTICAL_IN_BODY))]
            self._static.write(tf_message(self._node.types, transforms))

    @property
    def refused(self) -> int:
        """Messages that found no room because a reader did not keep up."""
        writers = [self._detections, self._markers, self._overlay, self._events, self._tf]
        return sum(writer.refused for writer in (*writers, *self._poses.values()))

    def publish(self, seen: LiveFrame, header: Header | None = None) -> None:
        """Publish what is known after a frame.

        Args:
            seen: of `Live.process`.
            header: of the frame's image as its source gave it, see `live_messages`.
        """
        # Whoever waits for this frame waits for its detections: first them, then all else.
        detections = live_detections(seen, self._ids, header)
        if self._detections.is_wanted:
            self._detections.write(detection3d_array(self._node.types, detections))
        tracks = live_tracks(seen, self._ids, header)
        self._publish_poses(tracks)
        if self._markers.is_wanted and (tracks.objects or tracks.lost):
            self._markers.write(marker_array(self._node.types, tracks, self._colors))
        if self._overlay.is_wanted:
            drawn = draw_detections(seen.frame, seen.detections, self._colors)
            self._overlay.write(image_message(self._node.types, detections.header, drawn, "rgb8"))

    def event(self, kind: str, message: str) -> None:
        """Publish what happened, in words; kept for those that come later."""
        self._send_event({"kind": kind, "message": message})

    def library(self, events: Iterable[LibraryEvent]) -> None:
        """Publish what happened to the library, kept as `event` is."""
        for event in events:
            self._send_event({**asdict(event), "kind": f"object {event.kind}"})

    def close(self) -> None:
        """End what was announced."""
        writers = [self._detections, self._markers, self._overlay, self._events, self._tf]
        for writer in (*writers, *self._poses.values(), self._static):
            if writer is not None:
                writer.close()

    def _publish_poses(self, tracks: TracksMessage) -> None:
        shown = [tracked for tracked in tracks.objects if tracked.seen]
        if shown and self._tf.is_wanted:
            transforms = [
                (tracks.header, self._ids.object(one.name, one.instance), one.pose.pose)
                for one in shown
            ]
            self._tf.write(tf_message(self._node.types, transforms))
        for one in shown:
            key = (one.name, one.instance)
            if key not in self._poses:
                self._poses[key] = self._pose_writer(*key)
            if self._poses[key].is_wanted:
                self._poses[key].write(pose_stamped(self._node.types, tracks.header, one.pose))

    def _pose_writer(self, name: str, instance: int) -> Writer:
        return self._node.writer(self._topics.pose(self._parts[name], instance), _POSE)

    def _send_event(self, content: dict[str, object]) -> None:
        text = json.dumps(content, ensure_ascii=False)
        self._events.write(self._node.types("std_msgs/msg/String")(data=text))
