"""Synthetic RGB-D frames with exact ground truth."""

from planegrasp.simulation.depth_sensor import KinectV1
from planegrasp.simulation.render import Rectangle, Rendering, render

__all__ = ["KinectV1", "Rectangle", "Rendering", "render"]
