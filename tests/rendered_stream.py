"""A short rendered stream with its truth, made once for all tests of a run."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import cv2
import numpy as np

from planegrasp.bench.stream import StreamSettings, models, stream
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.grasping import CanonicalGrasp
from planegrasp.live import Live, LiveConfig

GRASP = CanonicalGrasp(
    "side/flipped",
    RigidTransform.from_components([0.12, 0.01, 0.02], Rotation.from_euler("z", 180, degrees=True)),
    0.06,
)


@cache
def shots(objects=1, frames=24, motion="handheld"):
    """Frames with their truth."""
    config = StreamSettings(objects=objects, seconds=frames / 30, motion=motion)
    return tuple(stream(config))


@cache
def taught(objects=1):
    """The objects; the first one can be grasped."""
    found = models(StreamSettings(objects=objects))
    found[0].grasps.append(GRASP)
    return tuple(found)


def covered(shot):
    """The frame with nothing to be seen in it."""
    grey = np.full_like(shot.frame.color, 120)
    return replace(shot.frame, color=grey)


def processed(detector, frames):
    """What a live system sees, the same in every run."""
    with Live(detector, config=LiveConfig(background=False)) as live:
        return [live.process(frame) for frame in frames]


def write_video(path, frames):
    """As Motion JPEG, which OpenCV opens like a camera."""
    camera = frames[0].camera
    size = (camera.width, camera.height)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, size)
    for frame in frames:
        writer.write(np.ascontiguousarray(frame.color[:, :, ::-1]))
    writer.release()
