"""Nearest-neighbour search over descriptors, and the ratio test over all objects."""

from planegrasp.matching.index import Matches, ReferenceIndex, ReferenceSet
from planegrasp.matching.neighbours import MATCHERS, NeighbourSearch, make_matcher

__all__ = [
    "MATCHERS",
    "Matches",
    "NeighbourSearch",
    "ReferenceIndex",
    "ReferenceSet",
    "make_matcher",
]
