"""Following objects from frame to frame between detections."""

from planegrasp.tracking.following import FollowConfig, Follower
from planegrasp.tracking.motion import MotionFilterConfig
from planegrasp.tracking.track import Track
from planegrasp.tracking.tracker import Tracker, TrackerConfig

__all__ = [
    "FollowConfig",
    "Follower",
    "MotionFilterConfig",
    "Track",
    "Tracker",
    "TrackerConfig",
]
