"""Where frames come from: images, videos, RGB-D folders, data sets, ROS recordings."""

from planegrasp.io.sources.base import FrameSource, assumed_camera
from planegrasp.io.sources.opening import open_source
from planegrasp.io.sources.ros_topics import RecordingTopics
from planegrasp.io.sources.sequence import FrameFiles, ImageSequence
from planegrasp.io.sources.video import VideoSource

__all__ = [
    "FrameFiles",
    "FrameSource",
    "ImageSequence",
    "RecordingTopics",
    "VideoSource",
    "assumed_camera",
    "open_source",
]
