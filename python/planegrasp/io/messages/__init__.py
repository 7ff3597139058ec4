"""One message model: what planegrasp says, as plain values that every transport only converts.

Values are numbers, texts and tuples of them, so that two messages can be compared field by field.
Poses and covariances follow ROS (REP-103): x, y, z, w; covariances along the axes of the frame that
the header names.
"""

from planegrasp.io.messages.frames import FrameIds
from planegrasp.io.messages.grasps import (
    GraspPlanMessage,
    GraspRefusalMessage,
    GraspVerdict,
    grasp_message,
)
from planegrasp.io.messages.header import Header, Stamp
from planegrasp.io.messages.library import FaceSize, LibraryEvent, LibraryEventKind, library_events
from planegrasp.io.messages.live_messages import live_messages
from planegrasp.io.messages.objects import (
    DetectedObject,
    DetectionsMessage,
    TrackedObject,
    TracksMessage,
    detections_message,
    tracks_message,
)
from planegrasp.io.messages.pose import (
    Box,
    Pose,
    PoseWithCovariance,
    TwistWithCovariance,
    parent_covariance,
)
from planegrasp.io.messages.task import task_from_json, task_to_json

__all__ = [
    "Box",
    "DetectedObject",
    "DetectionsMessage",
    "FaceSize",
    "FrameIds",
    "GraspPlanMessage",
    "GraspRefusalMessage",
    "GraspVerdict",
    "Header",
    "LibraryEvent",
    "LibraryEventKind",
    "Pose",
    "PoseWithCovariance",
    "Stamp",
    "TrackedObject",
    "TracksMessage",
    "TwistWithCovariance",
    "detections_message",
    "grasp_message",
    "library_events",
    "live_messages",
    "parent_covariance",
    "task_from_json",
    "task_to_json",
    "tracks_message",
]
