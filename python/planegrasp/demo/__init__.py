"""A demonstration that needs no camera: teach photographs, render frames, find, compare.

objects.py     what is taught: two flat pictures and a box with three printed sides
scene.py       where they are in each frame, exactly, and how the camera sees them
scoring.py     estimated against true poses
recording.py   the folder with everything that is written
run.py         the story from beginning to end
"""

from planegrasp.demo.run import Demo, DemoOutcome
from planegrasp.demo.scoring import Comparison, ObjectScore

__all__ = ["Comparison", "Demo", "DemoOutcome", "ObjectScore"]
