"""Frames in, results out: camera and image files, frame sources and result sinks."""

from planegrasp.io.camera_file import read_camera, write_camera
from planegrasp.io.images import read_color, read_depth, write_color, write_depth

__all__ = [
    "read_camera",
    "read_color",
    "read_depth",
    "write_camera",
    "write_color",
    "write_depth",
]
