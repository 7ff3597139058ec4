"""What is seen, for Foxglove: an MCAP file with its schemas, and a live server.

    /camera/color/image                      RawImage or CompressedImage
    /camera/color/calibration                CameraCalibration
    /camera/color/annotations                ImageAnnotations: outlines, axes, labels
    /camera/aligned_depth_to_color/image     RawImage, 16UC1 [mm] or 32FC1 [m]
    /camera/aligned_depth_to_color/points    PointCloud
    /tf                                      FrameTransforms: camera, objects that are seen
    /planegrasp/scene                        SceneUpdate: boxes, axes, names
    /planegrasp/detections, tracks, grasp_plans, grasp_refusals, library
                                             the messages of `planegrasp.io.messages` as JSON
    /planegrasp/grasp_scene                  SceneUpdate: the gripper at the planned grasp
    /planegrasp/events                       Log: what happened, in words

`FoxgloveStream` logs into both; `open_source` reads such a file back.
"""

from planegrasp.io.foxglove import _dependencies  # noqa: F401, I001
from planegrasp.io.foxglove.config import ColorFormat, FoxgloveConfig, FoxgloveTopics
from planegrasp.io.foxglove.log_file import McapLog
from planegrasp.io.foxglove.server import FoxgloveServer, ServerAddress
from planegrasp.io.foxglove.stream import FoxgloveStream
from planegrasp.io.foxglove.detections_log import DetectionsLog

__all__ = [
    "ColorFormat",
    "DetectionsLog",
    "FoxgloveConfig",
    "FoxgloveServer",
    "FoxgloveStream",
    "FoxgloveTopics",
    "McapLog",
    "ServerAddress",
]
