"""Ways to find the k nearest descriptors, each built once over all references."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import cv2
import numpy as np

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
    """Exact search: L2 for vectors, Hamming for bit strings."""

    def __init__(self, references: Descriptors, *, binary: bool) -> None:
        self._binary = binary
        self._references = _prepared(references, binary=binary)
        self._norm = cv2.NORM_HAMMING if binary else cv2.NORM_L2
        self._distance_type = cv2.CV_32S if binary else cv2.CV_32F

    def search(self, queries: Descriptors, k: int) -> Neighbours:
        """Find the k nearest of each query, see `NeighbourSearch.search`."""
        if not len(queries):
            return _pad(np.zeros((0, 0), np.int32), np.zeros((0, 0), np.float32), k)
        found = min(k, len(self._references))
        distances, indices = cv2.batchDistance(
            _prepared(queries, binary=self._binary),
            self._references,
            dtype=self._distance_type,
            normType=self._norm,
            K=found,
        )
        return _pad(np.asarray(indices), np.asarray(distances), k)


class Flann:
    """Approximate search by OpenCV's FLANN (Muja & Lowe, PAMI 2014)."""

    def __init__(
        self,
        references: Descriptors,
        index: Mapping[str, int | float | bool],
        checks: int,
        *,
        binary: bool,
    ) -> None:
        self._size = len(references)
        self._binary = binary
        self._references = _prepared(references, binary=binary)
        self._checks = checks
        # FLANN draws from OpenCV's global generator: fixed, equal input gives equal trees.
        cv2.setRNGSeed(0)
        distance = _FLANN_HAMMING if binary else _FLANN_L2
        self._index = cv2.flann.Index(self._references, dict(index), distance)

    def search(self, queries: Descriptors, k: int) -> Neighbours:
        """Find about the k nearest of each query, see `NeighbourSearch.search`."""
        if not len(queries):
            return _pad(np.zeros((0, 0), np.int32), np.zeros((0, 0), np.float32), k)
        indices, distances = self._index.knnSearch(
            _prepared(queries, binary=self._binary),
            min(k, self._size),
            params={"checks": self._checks},
        )
        found = np.asarray(distances, dtype=np.float32)
        if not self._binary:
            found = np.sqrt(found)
        return _pad(np.asarray(indices), found, k)


def flann_kdtree(
    references: Descriptors, trees: int = 4, checks: int = 64, *, binary: bool
) -> NeighbourSearch:
    """Randomised k-d trees, for vectors (the paper's matcher)."""
    _require("flann-kdtree", vectors=not binary)
    index = {"algorithm": _FLANN_KDTREE, "trees": trees}
    return Flann(references, index, checks, binary=binary)


def flann_kmeans(
    references: Descriptors,
    branching: int = 32,
    iterations: int = 7,
    checks: int = 128,
    *,
    binary: bool,
) -> NeighbourSearch:
    """Hierarchical k-means tree, for vectors (the paper's future work)."""
    _require("flann-kmeans", vectors=not binary)
    index = {"algorithm": _FLANN_KMEANS, "branching": branching, "iterations": iterations}
    return Flann(references, index, checks, binary=binary)


def flann_lsh(
    references: Descriptors, tables: int = 12, key_bits: int = 20, probes: int = 2, *, binary: bool
) -> NeighbourSearch:
    """Multi-probe locality-sensitive hashing, for bit strings (the paper's future work)."""
    _require("flann-lsh", vectors=not binary)
    index = {
        "algorithm": _FLANN_LSH,
        "table_number": tables,
        "key_size": key_bits,
        "multi_probe_level": probes,
    }
    return Flann(references, index, checks=32, binary=binary)


MATCHERS: dict[str, Callable[..., NeighbourSearch]] = {
    "brute-force": BruteForce,
    "flann-kdtree": flann_kdtree,
    "flann-kmeans": flann_kmeans,
    "flann-lsh": flann_lsh,
}


def make_matcher(name: str, references: Descriptors, *, binary: bool) -> NeighbourSearch:
    """Build the search of that name over M×D references.

    Args:
        name: in `MATCHERS`.
        references: M×D.
        binary: whether they are bit strings, compared by Hamming, or vectors, compared by L2.

    Raises:
        InvalidInputError: no matcher has that name, or it is not for this kind of descriptor.
    """
    if name not in MATCHERS:
        raise InvalidInputError(f"no matcher is called {name!r}; there are {', '.join(MATCHERS)}")
    return MATCHERS[name](references, binary=binary)


def _require(name: str, *, vectors: bool) -> None:
    if vectors == (name == "flann-lsh"):
        kind, other = ("bit strings", "vectors") if vectors else ("vectors", "bit strings")
        raise InvalidInputError(
            f"matcher {name!r} searches {kind}, this extractor gives {other}: use brute-force"
            f" or {'flann-kdtree' if vectors else 'flann-lsh'}"
        )


def _prepared(descriptors: Descriptors, *, binary: bool) -> Descriptors:
    """C-contiguous, and vectors as float32: all that OpenCV takes."""
    if binary:
        return np.ascontiguousarray(descriptors, np.uint8)
    return np.ascontiguousarray(descriptors, np.float32)


def _pad(indices: NDArray[np.int32], distances: NDArray[np.float32], k: int) -> Neighbours:
    """N×k results with -1 and infinity where fewer than k were found."""
    n, found = indices.shape
    padded_indices = np.full((n, k), -1, np.int32)
    padded_distances = np.full((n, k), np.inf, np.float32)
    padded_indices[:, :found] = indices
    padded_distances[:, :found] = distances
    padded_distances[padded_indices < 0] = np.inf
    return padded_indices, padded_distances
