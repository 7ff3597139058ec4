"""Which of a face's many descriptors are worth keeping, learnt from made-up views of it.

All oblique views of a reference together have ten thousand descriptors and more; most never find
anything. Trial views of the reference, at other angles, sizes and with a camera's noise, tell which
do: a descriptor serves a feature of a trial view where it is the right place, and nearer than what
lies elsewhere on the face. The most useful are those that together serve as many features of as
many views as possible (greedy maximum coverage, in the core).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp import _core
from planegrasp.errors import InvalidInputError
from planegrasp.features.oblique import View, known_signs, oblique_view

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from planegrasp.features.base import Extractor
    from planegrasp.features.oblique import ObliqueFeatures

# Neighbours of a trial feature that may serve it.
_NEIGHBOURS = 16
# A keypoint of a trial view is at the right place within so many pixels of the view.
_RIGHT_PX = 2.0
# Serving takes a distance below this share of that to the nearest elsewhere (the ratio test).
_RATIO = 0.8
# Share of the trial views that are poor.
_POOR_VIEWS = 0.1


@dataclass(frozen=True, slots=True)
class PruningConfig:
    """How many descriptors are kept, and how they are chosen.

    Attributes:
        max_descriptors: of one face; 0 keeps all, unordered.
        views: trial views. Tilts are spread evenly over log t, t = 1 / cos(angle): half of the
            views are beyond about 65°, where matches are few.
        max_tilt_deg: of a trial view.
        min_scale: the smallest trial views have this share of the reference's size, the largest
            have its size.
        noise: σ of the trial views' image noise [grey levels].
        seed: of the trial views.
    """

    max_descriptors: int = 3000
    views: int = 150
    max_tilt_deg: float = 82.0
    min_scale: float = 0.35
    noise: float = 3.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.max_descriptors < 0 or self.views < 1:
            raise InvalidInputError(
                f"need max_descriptors ≥ 0 and views ≥ 1, got {self.max_descriptors}, {self.views}"
            )
        if not (0 <= self.max_tilt_deg < 90 and 0 < self.min_scale <= 1 and self.noise >= 0):
            raise InvalidInputError(
                "need 0 ≤ max_tilt_deg < 90, 0 < min_scale ≤ 1 and noise ≥ 0, got "
                f"{self.max_tilt_deg}, {self.min_scale}, {self.noise}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class _Trial:
    """Features of all trial views.

    Attributes:
        descriptors: F×D.
        signs: F, see `Features`.
        points: F×2, where they truly lie on the reference (pixels, centres at integers).
        view_from_reference: F×2×2, the linear part of each one's view.
        view: F, number of the view.
    """

    descriptors: NDArray[np.uint8]
    signs: NDArray[np.int8]
    points: NDArray[np.float64]
    view_from_reference: NDArray[np.float64]
    view: NDArray[np.uint32]


@dataclass(frozen=True, slots=True, eq=False)
class Useful:
    """The features of a face that are worth keeping.

    Attributes:
        order: indices into the features, the most useful first.
        served: how many features of a poor trial view they serve: nine in ten views have more.
            A face of which that is little needs more descriptors to be found by.
    """

    order: NDArray[np.intp]
    served: float


def by_usefulness(
    features: ObliqueFeatures,
    gray: NDArray[np.uint8],
    extractor: Extractor,
    *,
    blur: float,
    same_place: float,
    config: PruningConfig,
) -> Useful:
    """The features worth keeping, at most `max_descriptors`.

    Args:
        features: of all oblique views; descriptors of bytes.
        gray: the h×w uint8 reference that they were taken from.
        extractor: of the features.
        blur: of oblique views, see `ObliqueConfig.blur`.
        same_place: points closer than this [px of the reference] are one place.
        config: settings.
    """
    if not len(features):
        return Useful(np.zeros(0, np.intp), 0.0)  # a trial view may have some: of its noise
    trial = _trial(gray, extractor, blur, config)
    index = _core.ReferenceIndex(features.descriptors.shape[1], is_binary=extractor.is_binary)
    descriptors = _bytes(features.descriptors)
    index.add(features.points, features.frames, descriptors, same_place, features.signs)
    this = np.zeros(1, np.uint32)
    _, reference, distance, _ = index.candidates(
        trial.descriptors, _NEIGHBOURS, among=this, signs=trial.signs
    )
    offset = features.points[reference] - trial.points[:, None]
    in_view = np.einsum("fab,fkb->fka", trial.view_from_reference, offset)
    right = (reference >= 0) & (np.linalg.norm(in_view, axis=2) <= _RIGHT_PX)
    apart = (reference < 0) | (np.linalg.norm(offset, axis=2) > same_place)
    elsewhere = np.where(apart, distance, np.inf).min(axis=1)
    serves = right & (distance <= _RATIO * elsewhere[:, None])
    feature, neighbour = np.nonzero(serves)
    server = reference[feature, neighbour]
    order = _core.by_usefulness(
        len(features), server.astype(np.uint32), feature.astype(np.uint32), trial.view
    )
    kept = order[: config.max_descriptors].astype(np.intp)
    served = np.unique(feature[np.isin(server, kept)])
    of_view = np.bincount(trial.view[served], minlength=config.views)
    return Useful(kept, float(np.quantile(of_view, _POOR_VIEWS)))


def _trial(
    gray: NDArray[np.uint8], extractor: Extractor, blur: float, config: PruningConfig
) -> _Trial:
    height, width = gray.shape
    parts: list[_Trial] = []
    for number, view in enumerate(_views(gray, blur, config)):
        features = extractor.extract(view.image)
        linear, shift = view.view_from_reference[:, :2], view.view_from_reference[:, 2]
        points = (features.points - shift) @ np.linalg.inv(linear).T
        inside = np.all((points >= 0) & (points <= (width - 1, height - 1)), axis=1)
        count = int(np.count_nonzero(inside))
        parts.append(
            _Trial(
                _bytes(features.descriptors[inside]),
                known_signs(features)[inside],
                points[inside],
                np.broadcast_to(linear, (count, 2, 2)),
                np.full(count, number, np.uint32),
            )
        )
    return _Trial(
        np.concatenate([p.descriptors for p in parts]),
        np.concatenate([p.signs for p in parts]),
        np.concatenate([p.points for p in parts]),
        np.concatenate([p.view_from_reference for p in parts]),
        np.concatenate([p.view for p in parts]),
    )


def _views(gray: NDArray[np.uint8], blur: float, config: PruningConfig) -> Iterator[View]:
    """Oblique views at random angles, shrunk, with noise."""
    rng = np.random.default_rng(config.seed)
    # Apart, so that the angles do not depend on how many pixels a view has.
    noise = np.random.default_rng([config.seed, 1])
    steepest = np.log(1.0 / np.cos(np.radians(config.max_tilt_deg)))
    for number in range(config.views):
        tilt = float(np.exp(steepest * (number + rng.random()) / config.views))
        view = oblique_view(gray, tilt, rng.uniform(0.0, np.pi), blur)
        scale = float(np.exp(rng.uniform(np.log(config.min_scale), 0.0)))
        height, width = view.image.shape
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        small = cv2.resize(view.image, size, interpolation=cv2.INTER_AREA)
        noisy = small + noise.normal(0.0, config.noise, small.shape)
        # Edges coincide, not pixel centres.
        factor = np.array([size[0] / width, size[1] / height])
        small_from_view = np.column_stack([np.diag(factor), 0.5 * factor - 0.5])
        yield View(
            np.clip(np.rint(noisy), 0, 255).astype(np.uint8),
            _after(small_from_view, view.view_from_reference),
        )


def _after(second: NDArray[np.float64], first: NDArray[np.float64]) -> NDArray[np.float64]:
    """The 2×3 map that applies `first`, then `second`."""
    linear = second[:, :2]
    shift = linear @ first[:, 2] + second[:, 2]
    return np.column_stack([linear @ first[:, :2], shift])


def _bytes(descriptors: NDArray[np.float32] | NDArray[np.uint8]) -> NDArray[np.uint8]:
    if descriptors.dtype != np.uint8:
        raise InvalidInputError(f"only descriptors of bytes can be pruned, got {descriptors.dtype}")
    return descriptors.astype(np.uint8, copy=False)
