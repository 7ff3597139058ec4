"""Teach a flat object with one photo and its width; find it and its 6-DoF pose in RGB-D frames.

    import planegrasp as pg

    library = pg.ObjectLibrary("objects")
    library.add(pg.ObjectModel.from_image("book", "book.jpg", width=0.21))
    library.save()

    detector = pg.Detector(library)
    for detection in detector.detect(pg.RGBDFrame(color, depth, camera)):
        print(detection.name, detection.T_camera_object)

These names are the public API. Each is imported when it is first used, so that `import planegrasp`
costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planegrasp.body import BoxBody
    from planegrasp.detection import Detection, DetectionReport
    from planegrasp.detector import Detector, DetectorConfig
    from planegrasp.errors import PlanegraspError
    from planegrasp.geometry import PinholeCamera, RigidTransform
    from planegrasp.grasping import CanonicalGrasp
    from planegrasp.grasping.plan import GraspPlan, GraspRefusal
    from planegrasp.grasping.planner import GraspPlanner, PlannerConfig
    from planegrasp.library import ObjectLibrary
    from planegrasp.live import Live, LiveConfig, LiveFrame, Task
    from planegrasp.objects import ObjectModel, PlanarFace
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.robot import Robot
    from planegrasp.teaching.quality import TeachingQuality, assess
    from planegrasp.teaching.teach import teach
    from planegrasp.tracking import Track, Tracker, TrackerConfig

    __version__: str

__all__ = [
    "BoxBody",
    "CanonicalGrasp",
    "Detection",
    "DetectionReport",
    "Detector",
    "DetectorConfig",
    "GraspPlan",
    "GraspPlanner",
    "GraspRefusal",
    "Live",
    "LiveConfig",
    "LiveFrame",
    "ObjectLibrary",
    "ObjectModel",
    "PinholeCamera",
    "PlanarFace",
    "PlanegraspError",
    "PlannerConfig",
    "RGBDFrame",
    "RigidTransform",
    "Robot",
    "Task",
    "TeachingQuality",
    "Track",
    "Tracker",
    "TrackerConfig",
    "assess",
    "teach",
]

_MODULES = {
    "BoxBody": "body",
    "CanonicalGrasp": "grasping",
    "Detection": "detection",
    "DetectionReport": "detection",
    "Detector": "detector",
    "DetectorConfig": "detector",
    "GraspPlan": "grasping.plan",
    "GraspPlanner": "grasping.planner",
    "GraspRefusal": "grasping.plan",
    "Live": "live",
    "LiveConfig": "live",
    "LiveFrame": "live",
    "ObjectLibrary": "library",
    "ObjectModel": "objects",
    "PinholeCamera": "geometry",
    "PlanarFace": "objects",
    "PlanegraspError": "errors",
    "PlannerConfig": "grasping.planner",
    "RGBDFrame": "rgbd",
    "RigidTransform": "geometry",
    "Robot": "robot",
    "Task": "live",
    "TeachingQuality": "teaching.quality",
    "Track": "tracking",
    "Tracker": "tracking",
    "TrackerConfig": "tracking",
    "assess": "teaching.quality",
    "teach": "teaching.teach",
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("planegrasp")
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
