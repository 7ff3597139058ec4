"""One index over the descriptors of all faces of all objects, and the ratio test on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from planegrasp import _core
from planegrasp.errors import InvalidInputError
from planegrasp.matching.neighbours import make_matcher

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.features.base import Features


NATIVE = "native"
# Of more than two faces a first look compares with fewer descriptors each: so many in all, or …
_FIRST_IN_ALL = 1800
# … so many of each on average. A face gets the more the fewer features its poor views have: a share
# as one over their number and this.
_FIRST_EACH = 280
_NEED_OFFSET = 10.0
# But at least so many.
_FIRST_AT_LEAST = 100
# A look between the first and the last is at this many times more descriptors than the first.
_MUCH_CLOSER = 1.5
# At least so many neighbours are looked for where the ratio is to one of them.
_NEIGHBOURS = 16


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceSet:
    """Descriptors of one face.

    Attributes:
        points: M×2 float32, reference image in edge coordinates.
        frames: M×2×2 float32, from each keypoint's own frame to the reference image.
        descriptors: M×D, of all oblique views.
        radius: two points of the face closer than this [reference px] count as the same place.
        served: how rich the face's poor views are, see `planegrasp.features.pruning.Useful`; 0 =
            unknown.
        signs: M int8, see `Features`; None = all 0.
    """

    points: NDArray[np.float32]
    frames: NDArray[np.float32]
    descriptors: NDArray[np.float32] | NDArray[np.uint8]
    radius: float
    served: float = 0.0
    signs: NDArray[np.int8] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """The k nearest reference descriptors of each feature of a frame.

    Attributes:
        face: N×k int32 number of the face, -1 = none.
        reference: N×k int32 index of the keypoint of that face.
        distances: N×k float32, ascending.
        ratio: N float32, nearest distance over the nearest elsewhere (on the face or on another
            one); 0 where all k neighbours are at the same place, 1 where two places are exactly
            alike, infinite where there is no neighbour.
    """

    face: NDArray[np.int32]
    reference: NDArray[np.int32]
    distances: NDArray[np.float32]
    ratio: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.face)


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What a first look at a frame's features gives.

    Attributes:
        candidates: among the faces worth looking at.
        faces: numbers of those faces.
        closer: numbers of descriptors of a face with which `ReferenceIndex.look_closer` could find
            more, ascending; the last is all of them.
    """

    candidates: Candidates
    faces: NDArray[np.uint32]
    closer: tuple[int, ...]


class ReferenceIndex(Protocol):
    """Nearest-neighbour search over all faces together.

    A point of a face has descriptors from many oblique views; the ratio test asks for the nearest
    descriptor that lies elsewhere, on this face or on another one.
    """

    def look(self, features: Features, k: int, among: NDArray[np.uint32] | None = None) -> Look:
        """The k nearest references of each feature, quickly; of some faces only if given."""
        ...

    def look_closer(
        self, features: Features, k: int, faces: NDArray[np.uint32], most: int
    ) -> Candidates:
        """The k nearest of so many references of some faces, the most useful ones."""
        ...


class NativeIndex:
    """The core's search over descriptors of bytes, in the order of their usefulness.

    A first look compares with the most useful descriptors of each face, of many faces only with
    those that an inverted file proposes. That finds most faces in view. The rest, oblique or weakly
    textured, shows in closer looks at more and then all descriptors of the faces not found.
    """

    def __init__(
        self, faces: Sequence[ReferenceSet], *, binary: bool, farthest: float, first: int
    ) -> None:
        length = faces[0].descriptors.shape[1]
        self._index = _core.ReferenceIndex(length, is_binary=binary, farthest=farthest)
        self._first = first or None
        self._sizes: list[int] = []
        # How large each face's share of a first look is, relative to others.
        self._need: list[float] = []
        for face in faces:
            self.add(face)

    @property
    def nbytes(self) -> int:
        """Bytes that it occupies."""
        return self._index.nbytes

    def add(self, face: ReferenceSet) -> None:
        """Add a face, which gets the next number; nothing is built anew."""
        descriptors = face.descriptors.astype(np.uint8, copy=False)
        self._index.add(face.points, face.frames, descriptors, face.radius, face.signs)
        self._sizes.append(len(face.points))
        self._need.append(1.0 / (_NEED_OFFSET + face.served))

    def look(self, features: Features, k: int, among: NDArray[np.uint32] | None = None) -> Look:
        """See `ReferenceIndex.look`."""
        descriptors = features.descriptors.astype(np.uint8, copy=False)
        keypoints = features.points, features.scales, features.angles
        faces = self._index.propose(descriptors, *keypoints, among=among)
        first = self._shares(faces)
        found = self._index.candidates(
            descriptors, k, among=faces, first=first, signs=features.signs
        )
        return Look(Candidates(*found), faces, self._closer(faces, first))

    def _closer(
        self, faces: NDArray[np.uint32], first: NDArray[np.uint32] | None
    ) -> tuple[int, ...]:
        """Of how many descriptors further looks are after one at so many of each face."""
        largest = max((self._sizes[face] for face in faces), default=0)
        if first is None or self._first is None or not len(faces) or largest <= first.min():
            return ()
        # As close as the first look at a small library, where that is much closer.
        middle = self._first
        is_much = _MUCH_CLOSER * first.min() < middle < largest
        return (middle, largest) if is_much else (largest,)

    def _shares(self, faces: NDArray[np.uint32]) -> NDArray[np.uint32] | None:
        """Descriptors of each face in a first look; None for all.

        A richly textured face is found by few of them, a weakly textured one needs many.
        """
        if self._first is None:
            return None
        in_all = max(_FIRST_IN_ALL, _FIRST_EACH * len(faces))
        if self._first * len(faces) <= in_all:
            return np.full(len(faces), self._first, np.uint32)
        need = np.array([self._need[face] for face in faces])
        shares = in_all * need / need.sum()
        least = min(_FIRST_AT_LEAST, self._first)
        return np.asarray(np.clip(shares, least, self._first), dtype=np.uint32)

    def look_closer(
        self, features: Features, k: int, faces: NDArray[np.uint32], most: int
    ) -> Candidates:
        """See `ReferenceIndex.look_closer`."""
        descriptors = features.descriptors.astype(np.uint8, copy=False)
        first = np.full(len(faces), most, np.uint32)
        found = self._index.candidates(
            descriptors, k, among=faces, first=first, signs=features.signs
        )
        return Candidates(*found)


class NeighbourIndex:
    """Any `NeighbourSearch`; the ratio looks among the k nearest only, and one look is all.

    Compares features of all signs.
    """

    def __init__(self, faces: Sequence[ReferenceSet], matcher: str, *, binary: bool) -> None:
        sizes = [len(f.points) for f in faces]
        self._all = np.arange(len(faces), dtype=np.uint32)
        self._face = np.repeat(np.arange(len(faces), dtype=np.int32), sizes)
        starts = np.concatenate([[0], np.cumsum(sizes)])[:-1]
        self._reference = np.arange(sum(sizes), dtype=np.int32) - np.repeat(starts, sizes)
        self._points = np.concatenate([f.points for f in faces])
        self._radius = np.array([f.radius for f in faces], np.float32)
        descriptors = np.concatenate([f.descriptors for f in faces])
        self._search = make_matcher(matcher, descriptors, binary=binary)

    def look(self, features: Features, k: int, among: NDArray[np.uint32] | None = None) -> Look:
        """See `ReferenceIndex.look`; compares with all faces also where only some are asked for."""
        faces = self._all if among is None else among
        return Look(self.look_closer(features, k, faces, len(self._face)), faces, closer=())

    def look_closer(
        self, features: Features, k: int, faces: NDArray[np.uint32], most: int
    ) -> Candidates:
        """See `ReferenceIndex.look_closer`; looks at all faces, and at all of them."""
        # The nearest elsewhere must be among them: more than a place has oblique views.
        indices, distances = self._search.search(features.descriptors, max(k, _NEIGHBOURS))
        known = indices >= 0
        face = np.where(known, self._face[indices], -1).astype(np.int32)
        points = self._points[indices]
        apart = np.linalg.norm(points - points[:, :1], axis=2)
        same_place = (face == face[:, :1]) & (apart <= self._radius[face[:, :1]])
        elsewhere = np.where(known & ~same_place, distances, np.inf).min(axis=1)
        nearest = distances[:, 0]
        # Exactly like two places (0 / 0) is as ambiguous as can be: 1.
        ratio = np.ones_like(nearest)
        np.divide(nearest, elsewhere, out=ratio, where=known[:, 0] & (elsewhere > 0))
        ratio[~known[:, 0]] = np.inf
        reference = self._reference[indices].astype(np.int32)
        return Candidates(face[:, :k], reference[:, :k], distances[:, :k], ratio)


def make_index(
    faces: Sequence[ReferenceSet],
    matcher: str,
    *,
    binary: bool,
    farthest: float = math.inf,
    first: int = 0,
) -> ReferenceIndex:
    """An index over M×D descriptors of each face.

    Args:
        faces: at least one.
        matcher: "native", a name in `MATCHERS`, or "": native for descriptors of bytes,
            flann-kdtree for others.
        binary: whether descriptors are bit strings, compared by Hamming, or vectors.
        farthest: the native matcher takes descriptors that are farther apart for unlike.
        first: how many descriptors of a face a first look of the native matcher compares with;
            0 = all.

    Raises:
        InvalidInputError: no matcher has that name, or it is not for this kind of descriptor.
    """
    in_bytes = faces[0].descriptors.dtype == np.uint8
    if matcher == NATIVE and not in_bytes:
        raise InvalidInputError(
            f"matcher 'native' searches bytes, this extractor gives {faces[0].descriptors.dtype}: "
            "use flann-kdtree or brute-force"
        )
    if matcher == NATIVE or (not matcher and in_bytes):
        return NativeIndex(faces, binary=binary, farthest=farthest, first=first)
    return NeighbourIndex(faces, matcher or "flann-kdtree", binary=binary)
