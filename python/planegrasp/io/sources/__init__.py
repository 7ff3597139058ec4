"""Where frames come from: images, videos, RGB-D folders, TUM and BOP data sets."""

from planegrasp.io.sources.base import FrameSource, assumed_camera
from planegrasp.io.sources.opening import open_source
from planegrasp.io.sources.sequence import FrameFiles, ImageSequence
from planegrasp.io.sources.video import VideoSource

__all__ = [
    "FrameFiles",
    "FrameSource",
    "ImageSequence",
    "VideoSource",
    "assumed_camera",
    "open_source",
]
