"""Nearest-neighbour search over descriptors, and the ratio test over all objects."""

from planegrasp.matching.index import Candidates, ReferenceIndex, ReferenceSet, make_index
from planegrasp.matching.neighbours import MATCHERS, NeighbourSearch, make_matcher

__all__ = [
    "MATCHERS",
    "Candidates",
    "NeighbourSearch",
    "ReferenceIndex",
    "ReferenceSet",
    "make_index",
    "make_matcher",
]
