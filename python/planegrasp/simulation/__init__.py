"""Synthetic RGB-D frames with exact ground truth.

The world for grasp experiments needs the extra `robot` and is imported by its modules: `world`,
`raycast_camera`, `hand_motion`, `objects`.
"""

from planegrasp.simulation.depth_sensor import KinectV1
from planegrasp.simulation.motion_blur import render_moving
from planegrasp.simulation.rectangle import Rectangle
from planegrasp.simulation.render import Rendering, render

__all__ = ["KinectV1", "Rectangle", "Rendering", "render", "render_moving"]
