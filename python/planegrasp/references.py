"""What the detector keeps of each taught face: descriptors of its oblique views."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import cv2
import numpy as np

from planegrasp.features.oblique import ObliqueConfig, ObliqueFeatures, extract_oblique
from planegrasp.features.pruning import PruningConfig, by_usefulness
from planegrasp.geometry import edge_from_pixel
from planegrasp.library import feature_cache
from planegrasp.library.feature_cache import feature_key
from planegrasp.matching.index import ReferenceSet

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from planegrasp.features.base import Extractor
    from planegrasp.objects import ObjectModel, PlanarFace

# Part of the cache's key: to be raised whenever the same settings give other features.
_VERSION = "7"


@dataclass(frozen=True, slots=True, eq=False)
class FaceReference:
    """One face of the library, ready to be found.

    Attributes:
        object: the object that carries the face.
        face: the face.
    """

    object: ObjectModel
    face: PlanarFace

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the reference image [px]."""
        height, width = self.face.image.shape[:2]
        return width, height


def prepare_face(
    model: ObjectModel,
    face: PlanarFace,
    extractor: Extractor,
    oblique: ObliqueConfig,
    *,
    pruning: PruningConfig,
    longest_side: int,
    same_place: float,
    cache: Path | None = None,
) -> tuple[FaceReference, ReferenceSet]:
    """Extract the features of a face, or take them from a cache.

    Args:
        model: the object.
        face: one of its faces.
        extractor: of the features.
        oblique: which views of the face are made.
        pruning: how many descriptors are kept; vectors of floats are all kept.
        longest_side: larger reference images are shrunk to this first [px]: detail finer than
            the camera will see costs memory and finds wrong matches.
        same_place: distance below which two points are the same place, over the longest side.
        cache: the object's cache folder, or None.

    Returns:
        The face, and its features for the index and the search.
    """
    gray = cv2.cvtColor(face.image, cv2.COLOR_RGB2GRAY)
    height, width = gray.shape
    key = feature_key(face, f"{_VERSION} {extractor!r} {oblique!r} {pruning!r} {longest_side}")
    arrays = feature_cache.load(cache, key)
    if arrays is None:
        scale = min(1.0, longest_side / max(width, height))
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        small = cv2.resize(gray, size, interpolation=cv2.INTER_AREA) if scale < 1.0 else gray
        features, served = _useful(extractor, small.astype(np.uint8), oblique, pruning, same_place)
        # Edge coordinates scale without an offset, pixel coordinates would not.
        enlarge = np.array([width / size[0], height / size[1]])
        arrays = {
            "points": (edge_from_pixel(features.points) * enlarge).astype(np.float32),
            "frames": (enlarge[:, None] * features.frames).astype(np.float32),
            "descriptors": features.descriptors,
            "signs": features.signs,
            "served": np.array(served),
        }
        feature_cache.store(cache, key, arrays)
    references = ReferenceSet(
        cast("NDArray[np.float32]", arrays["points"]),
        cast("NDArray[np.float32]", arrays["frames"]),
        cast("NDArray[np.float32]", arrays["descriptors"]),
        same_place * max(width, height),
        float(cast("NDArray[np.float64]", arrays["served"])),
        cast("NDArray[np.int8]", arrays["signs"]),
    )
    return FaceReference(model, face), references


def _useful(
    extractor: Extractor,
    gray: NDArray[np.uint8],
    oblique: ObliqueConfig,
    pruning: PruningConfig,
    same_place: float,
) -> tuple[ObliqueFeatures, float]:
    """Features of all views, the most useful first and only so many, and `Useful.served`."""
    features = extract_oblique(extractor, gray, oblique)
    if not pruning.max_descriptors or features.descriptors.dtype != np.uint8:
        return features, 0.0
    distance = same_place * max(gray.shape)
    useful = by_usefulness(
        features, gray, extractor, blur=oblique.blur, same_place=distance, config=pruning
    )
    return features.select(useful.order), useful.served
