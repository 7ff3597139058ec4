"""Looking at results: drawings on images, grids of images, Rerun recordings."""

from planegrasp.viz.filmstrip import filmstrip
from planegrasp.viz.overlay import draw_detections
from planegrasp.viz.palette import object_colors

__all__ = ["draw_detections", "filmstrip", "object_colors"]
