"""The demonstration from beginning to end, without a word on the screen."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from statistics import median
from typing import TYPE_CHECKING

from planegrasp.demo.objects import demo_objects
from planegrasp.demo.recording import DemoFolder
from planegrasp.demo.scene import shots
from planegrasp.demo.scoring import Comparison, ObjectScore, compare, false_detections
from planegrasp.detector import Detector
from planegrasp.library import ObjectLibrary
from planegrasp.teaching.teach import teach

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from planegrasp.objects import ObjectModel
    from planegrasp.teaching.quality import TeachingQuality


@dataclass(frozen=True, slots=True)
class DemoOutcome:
    """What came of it.

    Attributes:
        comparisons: every object in every frame, in order.
        false_detections: detections of what is not there.
        detection_ms: median time to detect in one frame.
        has_recording: whether a Rerun recording was written.
    """

    comparisons: tuple[Comparison, ...]
    false_detections: int
    detection_ms: float
    has_recording: bool

    @property
    def scores(self) -> tuple[ObjectScore, ...]:
        """One entry an object."""
        names = dict.fromkeys(c.name for c in self.comparisons)
        return tuple(ObjectScore.of(name, self.comparisons) for name in names)

    @property
    def faults(self) -> tuple[str, ...]:
        """What is worse than it should be, in words."""
        faults = [fault for score in self.scores for fault in score.faults]
        if self.false_detections:
            faults.append(f"{self.false_detections} detections of what is not there")
        return tuple(faults)


@dataclass(slots=True)
class Demo:
    """Teach, then render, detect and compare, into one folder.

    Attributes:
        path: the folder.
        frames: how many.
        seed: of the sensors' noise.
        models: what is taught.
    """

    path: Path
    frames: int = 12
    seed: int = 0
    models: tuple[ObjectModel, ...] = field(default_factory=demo_objects)

    @property
    def library_path(self) -> Path:
        """Where the objects are kept."""
        return self.path / "objects"

    def teach(self) -> dict[str, dict[str, TeachingQuality]]:
        """Teach the objects; the verdict on each face by object and face.

        Raises:
            LibraryError: the folder has a library that cannot be read, or cannot be written.
        """
        library = ObjectLibrary(self.library_path)
        return {model.name: teach(library, model, replace=True) for model in self.models}

    def detector(self) -> Detector:
        """The detector of the taught objects."""
        library = ObjectLibrary(self.library_path)
        return Detector([library[model.name] for model in self.models])

    def run(self, detector: Detector, advance: Callable[[], None]) -> DemoOutcome:
        """Render, detect, compare and write; `advance` is called after every frame."""
        comparisons: list[Comparison] = []
        seconds: list[float] = []
        false = 0
        with DemoFolder(self.path, self.models) as folder:
            for shot in shots(self.models, self.frames, self.seed):
                start = time.perf_counter()
                detections = detector.detect(shot.frame)
                seconds.append(time.perf_counter() - start)
                comparisons += compare(shot, detections)
                false += false_detections(shot, detections)
                folder.write(shot, detections)
                advance()
            folder.write_filmstrip()
        return DemoOutcome(tuple(comparisons), false, 1e3 * median(seconds), folder.has_recording)
