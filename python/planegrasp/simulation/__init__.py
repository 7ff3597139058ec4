"""Synthetic RGB-D frames with exact ground truth."""

from planegrasp.simulation.depth_sensor import KinectV1
from planegrasp.simulation.rectangle import Rectangle
from planegrasp.simulation.render import Rendering, render

__all__ = ["KinectV1", "Rectangle", "Rendering", "render"]
