"""False positives on frames that show none of the taught objects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench import textures
from planegrasp.bench.distractors import distractor_scene
from planegrasp.bench.result import BenchResult
from planegrasp.bench.scenes import photograph
from planegrasp.detector import Detector, DetectorConfig
from planegrasp.io.sources import open_source

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from planegrasp.rgbd import RGBDFrame


@dataclass(frozen=True, slots=True)
class NegativesSettings:
    """How much is measured.

    Attributes:
        frames: rendered frames, besides the recorded ones.
        data: folder with recorded RGB-D frames without any of the objects, or None.
        extractor: of the detector, by its name in `DetectorConfig`.
    """

    frames: int = 600
    data: Path | None = None
    extractor: str = "sift"

    @classmethod
    def quick(cls, data: Path | None = None) -> NegativesSettings:
        """Under a minute."""
        return cls(frames=60, data=data)

    @property
    def steps(self) -> int:
        """Number of frames, where the recorded ones say how many they are."""
        recorded = 0 if self.data is None else open_source(self.data).length or 0
        return self.frames + recorded


def run(seed: int, settings: NegativesSettings, advance: Callable[[], None]) -> BenchResult:
    """Look for all six photographs in frames that have none of them."""
    models = [photograph(name) for name in textures.OBJECTS]
    detector = Detector(models, DetectorConfig(extractor=settings.extractor))
    rows: list[dict[str, str | float]] = []
    totals = {"frames": 0, "false_positives": 0}
    for kind, frames in _frames(seed, settings):
        count, false = 0, []
        for frame in frames:
            found = detector.detect(frame)
            false += [f"{d.name} in {frame.name} ({d.inliers} inliers)" for d in found]
            count += 1
            advance()
        rows.append({"frames of": kind, "frames": count, "false positives": len(false)})
        rows += [{"frames of": f, "frames": "", "false positives": ""} for f in false[:10]]
        totals["frames"] += count
        totals["false_positives"] += len(false)
    return BenchResult(
        bench="negatives",
        seed=seed,
        settings={
            "frames": settings.frames,
            "data": str(settings.data or ""),
            "extractor": settings.extractor,
        },
        rows=rows,
        figures={name: float(value) for name, value in totals.items()},
        notes=("six objects are taught, none is in any frame",),
    )


def _frames(seed: int, settings: NegativesSettings) -> Iterator[tuple[str, Iterator[RGBDFrame]]]:
    if settings.data is not None:
        yield "recorded", iter(open_source(settings.data))

    def rendered() -> Iterator[RGBDFrame]:
        for i in range(settings.frames):
            yield distractor_scene(np.random.default_rng([seed, i]), name=f"rendered {i}")

    yield "rendered", rendered()
