"""Detection time against the number of objects: the paper's Table II, and on to large libraries."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.bench import paper, textures
from planegrasp.bench.result import BenchResult
from planegrasp.bench.scenes import CAMERA, CORNER_TOLERANCE, corner_error, facing_pose, rectangles
from planegrasp.bench.textures import texture
from planegrasp.detector import Detector
from planegrasp.objects import ObjectModel
from planegrasp.simulation import render

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planegrasp.simulation import Rendering

_WIDTH = 0.16
# Six places in the image, far enough apart for all six objects at once [m].
_PLACES = [(x, y) for y in (-0.13, 0.13) for x in (-0.27, 0.0, 0.27)]
# The first backgrounds are the scenery, the others give crops: no crop is in view by accident.
_SCENERY = 5


@dataclass(frozen=True, slots=True)
class ObjectsSettings:
    """How much is measured.

    Attributes:
        frames: for each number of objects.
        in_view: numbers of objects that are taught and shown at once (paper: 1 … 6).
        libraries: sizes of larger libraries, of which six objects are shown at once.
    """

    frames: int = 20
    in_view: tuple[int, ...] = (1, 2, 3, 4, 5, 6)
    libraries: tuple[int, ...] = (10, 30)

    @classmethod
    def quick(cls) -> ObjectsSettings:
        """Under a minute."""
        return cls(frames=4, libraries=(10,))

    @property
    def steps(self) -> int:
        """Number of rendered frames."""
        return self.frames * (len(self.in_view) + len(self.libraries))


def run(seed: int, settings: ObjectsSettings, advance: Callable[[], None]) -> BenchResult:
    """Measure times in alternation: every round has one frame of each number of objects."""
    largest = max((*settings.in_view, *settings.libraries))
    models = library_of(largest, np.random.default_rng([seed, 0]))
    detectors = {n: Detector(models[:n]) for n in sorted({*settings.in_view, *settings.libraries})}
    seconds: dict[int, list[float]] = {n: [] for n in detectors}
    found: dict[int, list[bool]] = {n: [] for n in detectors}
    for i in range(settings.frames):
        for n, detector in detectors.items():
            shown = models[: min(n, len(_PLACES))]
            rendering = _scene(shown, np.random.default_rng([seed, 1, i]))
            start = time.perf_counter()
            detections = detector.detect(rendering.frame)
            seconds[n].append(time.perf_counter() - start)
            by_name = {d.name: d for d in detections}
            for model, truth in zip(shown, rendering.corners, strict=True):
                detection = by_name.get(model.name)
                found[n].append(
                    detection is not None
                    and truth is not None
                    and corner_error(detection.corners, truth) < CORNER_TOLERANCE
                )
            advance()

    one = float(np.median(seconds[min(seconds)]))
    rows: list[dict[str, str | float]] = []
    figures: dict[str, float] = {}
    for n, detector in detectors.items():
        median = float(np.median(seconds[n]))
        rows.append(
            {
                "objects": n,
                "ms / frame": 1e3 * median,
                "over one object": median / one,
                "paper SIFT, over one": _paper_ratio("sift", n),
                "paper SURF, over one": _paper_ratio("surf", n),
                "recall": float(np.mean(found[n])),
                "MB / object": _megabytes(detector) / n,
            }
        )
        figures[f"time_{n}_over_1"] = median / one
        figures[f"recall_{n}"] = float(np.mean(found[n]))
    figures["megabytes_per_object"] = _megabytes(detectors[largest]) / largest
    return BenchResult(
        bench="objects",
        seed=seed,
        settings={"frames": settings.frames, "libraries": list(settings.libraries)},
        rows=rows,
        figures=figures,
        notes=(
            "up to six objects are in view at once; recall is over those in view",
            "paper: Table II of the paper, its time for n objects over that for one",
        ),
    )


def library_of(number: int, rng: np.random.Generator) -> list[ObjectModel]:
    """The six photographs, then random crops of others that are no scenery here."""
    models = [ObjectModel.from_image(n, texture(n), _WIDTH) for n in textures.OBJECTS]
    sources = textures.backgrounds()[_SCENERY:]
    while len(models) < number:
        image = sources[int(rng.integers(len(sources)))]
        side = int(rng.integers(120, min(320, *image.shape[:2])))
        y, x = (int(rng.integers(s - side + 1)) for s in image.shape[:2])
        crop = cv2.resize(image[y : y + side, x : x + side], (320, 320)).astype(np.uint8)
        models.append(ObjectModel.from_image(f"crop-{len(models)}", crop, _WIDTH))
    return models[:number]


def _scene(models: Sequence[ObjectModel], rng: np.random.Generator) -> Rendering:
    """The models in some of the six places; the same scenery and poses however many there are."""
    scenery = textures.backgrounds()[int(rng.integers(_SCENERY))]
    places = rng.permutation(len(_PLACES))
    poses = rng.uniform((0, 0, 0), (np.radians(40), 2 * np.pi, 2 * np.pi), (len(_PLACES), 3))
    things = []
    for model, place, (tilt, axis, roll) in zip(models, places, poses, strict=False):
        position = np.array([*_PLACES[place], 0.85])
        things += rectangles(model, facing_pose(position, tilt, axis, roll))
    return render(things, CAMERA, rng, background=scenery)


def _paper_ratio(extractor: str, objects: int) -> float | str:
    times = paper.SECONDS_BY_OBJECTS[extractor]
    return times[objects - 1] / times[0] if objects <= len(times) else ""


def _megabytes(detector: Detector) -> float:
    """Memory of descriptors and points of all faces [MB]."""
    arrays = [a for r in detector.references for a in (r.set.points, r.set.descriptors)]
    return sum(a.nbytes for a in arrays) / 1e6
