"""The channels of a stream."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from foxglove import Channel
from foxglove.channels import (
    CameraCalibrationChannel,
    CompressedImageChannel,
    FrameTransformsChannel,
    ImageAnnotationsChannel,
    LogChannel,
    PointCloudChannel,
    RawImageChannel,
    SceneUpdateChannel,
)

from planegrasp.io.foxglove.config import ColorFormat
from planegrasp.io.foxglove.documents import encoded, schema_of
from planegrasp.io.messages.grasps import GraspPlanMessage, GraspRefusalMessage
from planegrasp.io.messages.library import LibraryEvent
from planegrasp.io.messages.objects import DetectionsMessage, TracksMessage

if TYPE_CHECKING:
    from foxglove import Context
    from foxglove.messages import CompressedImage, RawImage

    from planegrasp.io.foxglove.config import FoxgloveTopics
    from planegrasp.io.messages.header import Stamp

__all__ = ["Channels"]


class Channels:
    """Where everything is logged, once, for all files and servers of a context.

    Attributes:
        color, calibration, annotations, depth, cloud, transforms, scene, grasp_scene, events: of
            Foxglove's messages.
    """

    def __init__(self, context: Context, topics: FoxgloveTopics, color: ColorFormat) -> None:
        self.color: RawImageChannel | CompressedImageChannel
        if color is ColorFormat.RAW:
            self.color = RawImageChannel(topics.color, context=context)
        else:
            self.color = CompressedImageChannel(topics.color, context=context)
        self.calibration = CameraCalibrationChannel(topics.calibration, context=context)
        self.annotations = ImageAnnotationsChannel(topics.annotations, context=context)
        self.depth = RawImageChannel(topics.depth, context=context)
        self.cloud = PointCloudChannel(topics.cloud, context=context)
        self.transforms = FrameTransformsChannel(topics.transforms, context=context)
        self.scene = SceneUpdateChannel(topics.scene, context=context)
        self.grasp_scene = SceneUpdateChannel(topics.grasp_scene, context=context)
        self.events = LogChannel(topics.events, context=context)
        self._documents = {
            kind: Channel(topic, schema=schema_of(kind), context=context)
            for kind, topic in (
                (DetectionsMessage, topics.detections),
                (TracksMessage, topics.tracks),
                (GraspPlanMessage, topics.grasp_plans),
                (GraspRefusalMessage, topics.grasp_refusals),
                (LibraryEvent, topics.library),
            )
        }

    def document(self, message: Any, stamp: Stamp) -> None:
        """Log a message of the message model as JSON."""
        channel = self._documents[type(message)]
        if channel.has_sinks():
            channel.log(encoded(message), log_time=stamp.total_nanoseconds)

    def log_color(self, image: RawImage | CompressedImage, time: int) -> None:
        """Log a colour image of the stream's format at a time [ns]."""
        self.color.log(image, log_time=time)  # type: ignore[arg-type]  # the two fit each other

    def close(self) -> None:
        """End all channels."""
        for channel in (
            self.color,
            self.calibration,
            self.annotations,
            self.depth,
            self.cloud,
            self.transforms,
            self.scene,
            self.grasp_scene,
            self.events,
            *self._documents.values(),
        ):
            channel.close()
