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
from planegrasp.detector import Detector, DetectorConfig
from planegrasp.features.pruning import PruningConfig
from planegrasp.objects import ObjectModel
from planegrasp.simulation import render

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from planegrasp.simulation import Rendering

_WIDTH = 0.16
# Six places in the image, far enough apart for all six objects at once [m].
_PLACES = [(x, y) for y in (-0.13, 0.13) for x in (-0.27, 0.0, 0.27)]
# Side of a made image [px].
_SIDE = 320
# A thousand objects are taught: with fewer trial views than by default, which takes half the time.
_CONFIG = DetectorConfig(pruning=PruningConfig(views=40))


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
    libraries: tuple[int, ...] = (10, 100, 1000)

    @classmethod
    def quick(cls) -> ObjectsSettings:
        """Under a minute."""
        return cls(frames=4, libraries=(10,))

    @property
    def steps(self) -> int:
        """Number of taught objects and of rendered frames."""
        sizes = (*self.in_view, *self.libraries)
        return max(sizes) + self.frames * len(sizes)


def run(seed: int, settings: ObjectsSettings, advance: Callable[[], None]) -> BenchResult:
    """Measure times in alternation: every round has one frame of each number of objects."""
    largest = max((*settings.in_view, *settings.libraries))
    models = library_of(largest, np.random.default_rng([seed, 0]))
    teacher = Detector(models[:1], _CONFIG)
    prepared = []
    for model in models:
        prepared += teacher.prepared(model)
        advance()
    sizes = sorted({*settings.in_view, *settings.libraries})
    # Every model has one face.
    detectors = {n: Detector.of(prepared[:n], _CONFIG) for n in sizes}
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

    one = np.array(seconds[min(seconds)])
    rows: list[dict[str, str | float]] = []
    figures: dict[str, float] = {}
    for n, detector in detectors.items():
        # Frame by frame: the scenery, which is the same, says how much there is to look at.
        over_one = float(np.median(np.array(seconds[n]) / one))
        rows.append(
            {
                "objects": n,
                "ms / frame": 1e3 * float(np.median(seconds[n])),
                "over one object": over_one,
                "paper SIFT, over one": _paper_ratio("sift", n),
                "paper SURF, over one": _paper_ratio("surf", n),
                "recall": float(np.mean(found[n])),
                "MB / object": 1e-6 * detector.nbytes / n,
            }
        )
        figures[f"time_{n}_over_1"] = over_one
        figures[f"recall_{n}"] = float(np.mean(found[n]))
    figures["megabytes_per_object"] = 1e-6 * detectors[largest].nbytes / largest
    return BenchResult(
        bench="objects",
        seed=seed,
        settings={"frames": settings.frames, "libraries": list(settings.libraries)},
        rows=rows,
        figures=figures,
        notes=(
            "up to six objects are in view at once; recall is over those in view",
            "over one object: of each frame, with one object in the same scenery; the median",
            "paper: Table II of the paper, its time for n objects over that for one",
        ),
    )


def library_of(number: int, rng: np.random.Generator) -> list[ObjectModel]:
    """The six photographs, then by turns crops of others and noise.

    Scenery gives no crops: none is in view by accident.
    """
    models = [ObjectModel.from_image(n, texture(n), _WIDTH) for n in textures.OBJECTS]
    sources = textures.backgrounds()[len(textures.scenery()) :]
    while len(models) < number:
        name = f"{'crop' if len(models) % 2 else 'texture'}-{len(models)}"
        image = _crop(sources, rng) if len(models) % 2 else _generated(rng)
        models.append(ObjectModel.from_image(name, image, _WIDTH))
    return models[:number]


def _crop(sources: Sequence[NDArray[np.uint8]], rng: np.random.Generator) -> NDArray[np.uint8]:
    """A square part of a photograph, turned and mirrored."""
    image = sources[int(rng.integers(len(sources)))]
    side = int(rng.integers(120, min(320, *image.shape[:2])))
    y, x = (int(rng.integers(s - side + 1)) for s in image.shape[:2])
    crop = cv2.resize(image[y : y + side, x : x + side], (_SIDE, _SIDE)).astype(np.uint8)
    crop = np.rot90(crop, int(rng.integers(4)))
    return np.ascontiguousarray(crop[:, ::-1] if rng.random() < 0.5 else crop)


def _generated(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Noise of several scales, coarse ones the stronger, as photographs have it."""
    image: NDArray[np.float64] = np.zeros((_SIDE, _SIDE, 3))
    for cells in (5, 10, 20, 40, 80):
        noise = rng.normal(size=(cells, cells, 3))
        enlarged = cv2.resize(noise, (_SIDE, _SIDE), interpolation=cv2.INTER_CUBIC)
        image += np.asarray(enlarged, dtype=np.float64) / cells**0.5
    return np.asarray(255 * (image - image.min()) / np.ptp(image), dtype=np.uint8)


def _scene(models: Sequence[ObjectModel], rng: np.random.Generator) -> Rendering:
    """The models in some of the six places; the same scenery and poses however many there are."""
    images = textures.scenery()
    scenery = images[int(rng.integers(len(images)))]
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
