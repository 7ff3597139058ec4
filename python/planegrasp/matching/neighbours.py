"""Ways to find the k nearest descriptors, each built once over all references."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import cv2
import numpy as np

from planegrasp import _core
from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    Descriptors = NDArray[np.float32] | NDArray[np.uint8]
    Neighbours = tuple[NDArray[np.int32], NDArray[np.float32]]

# Identifiers of cvflann's index types (opencv2/flann/defines.h).
_FLANN_KDTREE = 1
_FLANN_KMEANS = 2
_FLANN_LSH = 6
_FLANN_L2 = 1
_FLANN_HAMMING = 9


class NeighbourSearch(Protocol):
    """The nearest reference descriptors of each query descriptor."""

    def search(self, queries: Descriptors, k: int) -> Neighbours:
        """Find up to k neighbours of each of the N queries (N×D).

        Returns:
            N×k indices into the references, nearest first, -1 where fewer were found, and
            N×k distances (L2, or number of differing bits), infinite where the index is -1.
        """
        ...


class BruteForce:
    """Exact search: L2 for float descriptors, Hamming for bit strings."""

    def __init__(self, references: Descriptors) -> None:
        self._references = _contiguous(references)
        is_binary = references.dtype == np.uint8
        self._norm = cv2.NORM_HAMMING if is_binary else cv2.NORM_L2
        self._distance_type = cv2.CV_32S if is_binary else cv2.CV_32F

    def search(self, queries: Descriptors, k: int) -> Neighbours:
        """Find the k nearest of each query, see `NeighbourSearch.search`."""
        if not len(queries):
            return _pad(np.zeros((0, 0), np.int32), np.zeros((0, 0), np.float32), k)
        found = min(k, len(self._references))
        distances, indices = cv2.batchDistance(
            _contiguous(queries),
            self._references,
            dtype=self._distance_type,
            normType=self._norm,
            K=found,
        )
        return _pad(np.asarray(indices), np.asarray(distances), k)


class Native:
    """Exact search of the core, for bit strings."""

    def __init__(self, references: Descriptors) -> None:
        if references.dtype != np.uint8:
            raise InvalidInputError(
                f"matcher 'native' searches bytes, this extractor gives {references.dtype}: use"
                " brute-force or flann-kdtree"
            )
        n, length = references.shape
        # Neighbours alone are asked for: where they lie does not matter.
        points, frames = np.zeros((n, 2), np.float32), np.zeros((n, 2, 2), np.float32)
        self._index = _core.ReferenceIndex(length, is_binary=True)
        self._index.add(points, frames, references.astype(np.uint8, copy=False), 0.0)

    def search(self, queries: Descriptors, k: int) -> Neighbours:
        """Find the k nearest of each query, see `NeighbourSearch.search`."""
        _, indices, distances, _ = self._index.candidates(queries.astype(np.uint8, copy=False), k)
        return indices, distances


class Flann:
    """Approximate search by OpenCV's FLANN (Muja & Lowe, PAMI 2014)."""

    def __init__(
        self, references: Descriptors, index: Mapping[str, int | float | bool], checks: int
    ) -> None:
        self._size = len(references)
        self._references = _contiguous(references)
        self._checks = checks
        is_binary = references.dtype == np.uint8
        # FLANN draws from OpenCV's global generator: fixed, equal input gives equal trees.
        cv2.setRNGSeed(0)
        distance = _FLANN_HAMMING if is_binary else _FLANN_L2
        self._index = cv2.flann.Index(self._references, dict(index), distance)

    def search(self, queries: Descriptors, k: int) -> Neighbours:
        """Find about the k nearest of each query, see `NeighbourSearch.search`."""
        if not len(queries):
            return _pad(np.zeros((0, 0), np.int32), np.zeros((0, 0), np.float32), k)
        indices, distances = self._index.knnSearch(
            _contiguous(queries), min(k, self._size), params={"checks": self._checks}
        )
        found = np.asarray(distances, dtype=np.float32)
        if self._references.dtype != np.uint8:
            found = np.sqrt(found)
        return _pad(np.asarray(indices), found, k)


def flann_kdtree(references: Descriptors, trees: int = 4, checks: int = 64) -> NeighbourSearch:
    """Randomised k-d trees, for float descriptors (the paper's matcher)."""
    _require(references, binary=False, name="flann-kdtree")
    return Flann(references, {"algorithm": _FLANN_KDTREE, "trees": trees}, checks)


def flann_kmeans(
    references: Descriptors, branching: int = 32, iterations: int = 7, checks: int = 128
) -> NeighbourSearch:
    """Hierarchical k-means tree, for float descriptors (the paper's future work)."""
    _require(references, binary=False, name="flann-kmeans")
    index = {"algorithm": _FLANN_KMEANS, "branching": branching, "iterations": iterations}
    return Flann(references, index, checks)


def flann_lsh(
    references: Descriptors, tables: int = 12, key_bits: int = 20, probes: int = 2
) -> NeighbourSearch:
    """Multi-probe locality-sensitive hashing, for bit strings (the paper's future work)."""
    _require(references, binary=True, name="flann-lsh")
    index = {
        "algorithm": _FLANN_LSH,
        "table_number": tables,
        "key_size": key_bits,
        "multi_probe_level": probes,
    }
    return Flann(references, index, checks=32)


MATCHERS: dict[str, Callable[[Descriptors], NeighbourSearch]] = {
    "brute-force": BruteForce,
    "native": Native,
    "flann-kdtree": flann_kdtree,
    "flann-kmeans": flann_kmeans,
    "flann-lsh": flann_lsh,
}


def make_matcher(name: str, references: Descriptors) -> NeighbourSearch:
    """Build the search of that name over M×D references.

    Raises:
        InvalidInputError: no matcher has that name, or it is not for this kind of descriptor.
    """
    if name not in MATCHERS:
        raise InvalidInputError(f"no matcher is called {name!r}; there are {', '.join(MATCHERS)}")
    return MATCHERS[name](references)


def _require(references: Descriptors, *, binary: bool, name: str) -> None:
    if (references.dtype == np.uint8) != binary:
        kind, other = ("bit strings", "float vectors") if binary else ("float vectors", "bits")
        raise InvalidInputError(
            f"matcher {name!r} searches {kind}, this extractor gives {other}: use brute-force"
            f" or {'flann-kdtree' if binary else 'flann-lsh'}"
        )


def _contiguous(descriptors: Descriptors) -> Descriptors:
    """OpenCV takes C-contiguous arrays only."""
    return descriptors if descriptors.flags.c_contiguous else descriptors.copy()


def _pad(indices: NDArray[np.int32], distances: NDArray[np.float32], k: int) -> Neighbours:
    """N×k results with -1 and infinity where fewer than k were found."""
    n, found = indices.shape
    padded_indices = np.full((n, k), -1, np.int32)
    padded_distances = np.full((n, k), np.inf, np.float32)
    padded_indices[:, :found] = indices
    padded_distances[:, :found] = distances
    padded_distances[padded_indices < 0] = np.inf
    return padded_indices, padded_distances
