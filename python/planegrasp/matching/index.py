"""One index over the descriptors of all faces of all objects, and the ratio test on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.matching.neighbours import make_matcher

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.features.base import Features


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceSet:
    """Descriptors of one face.

    Attributes:
        points: M×2 float32, reference image in edge coordinates.
        frames: M×2×2 float32, from each keypoint's own frame to the reference image.
        descriptors: M×D, of all oblique views.
        radius: two points of the face closer than this [reference px] count as the same place.
    """

    points: NDArray[np.float32]
    frames: NDArray[np.float32]
    descriptors: NDArray[np.float32] | NDArray[np.uint8]
    radius: float


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Matches of a frame's features with one face.

    Attributes:
        query: n indices into the frame's features.
        reference_points: n×2 float64, reference image in edge coordinates.
        image_points: n×2 float64, frame in undistorted pixels.
        affine: n×2×2 float64, how the keypoints' own frames say that the neighbourhood of the
            reference point is mapped into the frame.
        ratio: n, distance over the distance of the nearest descriptor elsewhere; small is good.
    """

    query: NDArray[np.intp]
    reference_points: NDArray[np.float64]
    image_points: NDArray[np.float64]
    affine: NDArray[np.float64]
    ratio: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.query)

    def select(self, keep: NDArray[np.bool_] | NDArray[np.intp]) -> Matches:
        """The matches at a mask or at indices."""
        return Matches(
            self.query[keep],
            self.reference_points[keep],
            self.image_points[keep],
            self.affine[keep],
            self.ratio[keep],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """The k nearest reference descriptors of each feature of a frame.

    Attributes:
        face: N×k index of the face, -1 = none.
        points: N×k×2 float32, reference image in edge coordinates.
        reference_frames: N×k×2×2 float32, of the references' keypoints.
        distances: N×k float32, ascending.
        image_points: N×2 float64, frame in undistorted pixels.
        image_frames: N×2×2 float64, of the frame's keypoints.
        ratio: N, nearest distance over the nearest elsewhere (on the face or on another one); 0
            where all k neighbours are at the same place, 1 where two places are exactly alike,
            infinite where there is no neighbour.
    """

    face: NDArray[np.int32]
    points: NDArray[np.float32]
    reference_frames: NDArray[np.float32]
    distances: NDArray[np.float32]
    image_points: NDArray[np.float64]
    image_frames: NDArray[np.float64]
    ratio: NDArray[np.float64]

    def matches(self, face: int, max_ratio: float) -> Matches:
        """Matches with one face that pass the ratio test."""
        query = np.flatnonzero((self.face[:, 0] == face) & (self.ratio <= max_ratio))
        return self._take(query, np.zeros(len(query), np.intp))

    def agreeing(self, face: int, homography: NDArray[np.float64], radius: float) -> Matches:
        """Matches with one face that a homography explains, whatever the ratio test says.

        Args:
            face: index of the face.
            homography: 3×3, reference (edge coordinates) to undistorted pixels.
            radius: largest accepted distance from where it puts the reference point [px].
        """
        x, y = self.points[..., 0].astype(np.float64), self.points[..., 1].astype(np.float64)
        h = homography
        w = h[2, 0] * x + h[2, 1] * y + h[2, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / w - self.image_points[:, :1]
            v = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / w - self.image_points[:, 1:]
            agrees = (self.face == face) & (w > 0) & (u * u + v * v <= radius * radius)
        first = np.argmax(agrees, axis=1)
        query = np.flatnonzero(agrees[np.arange(len(first)), first])
        return self._take(query, first[query])

    def without(self, drop: NDArray[np.bool_]) -> Candidates:
        """The same without some features of the frame."""
        keep = ~drop
        return Candidates(
            self.face[keep],
            self.points[keep],
            self.reference_frames[keep],
            self.distances[keep],
            self.image_points[keep],
            self.image_frames[keep],
            self.ratio[keep],
        )

    def _take(self, query: NDArray[np.intp], neighbour: NDArray[np.intp]) -> Matches:
        return Matches(
            query,
            self.points[query, neighbour].astype(np.float64),
            self.image_points[query],
            self.image_frames[query]
            @ np.linalg.inv(self.reference_frames[query, neighbour].astype(np.float64)),
            self.ratio[query],
        )


class ReferenceIndex:
    """Nearest-neighbour search over all faces together."""

    def __init__(self, faces: Sequence[ReferenceSet], matcher: str, *, binary: bool) -> None:
        self._sizes = [len(f.points) for f in faces]
        self._face = np.repeat(np.arange(len(faces), dtype=np.int32), self._sizes)
        self._points = np.concatenate([f.points for f in faces])
        self._frames = np.concatenate([f.frames for f in faces])
        self._radius = np.array([f.radius for f in faces], np.float32)
        self._search = make_matcher(
            matcher, np.concatenate([f.descriptors for f in faces]), binary=binary
        )

    def __len__(self) -> int:
        return len(self._points)

    def candidates(
        self, features: Features, image_points: NDArray[np.float64], k: int
    ) -> Candidates:
        """The k nearest references of each feature, with the ratio to the nearest elsewhere.

        A point of a face has descriptors from many oblique views; the ratio test asks for the
        nearest descriptor that lies elsewhere, on this face or on another one.
        """
        indices, distances = self._search.search(features.descriptors, k)
        known = indices >= 0
        face = np.where(known, self._face[indices], -1).astype(np.int32)
        points = self._points[indices]
        apart = np.linalg.norm(points - points[:, :1], axis=2)
        same_place = (face == face[:, :1]) & (apart <= self._radius[face[:, :1]])
        elsewhere = np.where(known & ~same_place, distances, np.inf).min(axis=1)
        nearest = distances[:, 0].astype(np.float64)
        # Exactly like two places (0 / 0) is as ambiguous as can be: 1.
        ratio = np.ones_like(nearest)
        np.divide(nearest, elsewhere, out=ratio, where=known[:, 0] & (elsewhere > 0))
        ratio[~known[:, 0]] = np.inf
        return Candidates(
            face, points, self._frames[indices], distances, image_points, features.frames, ratio
        )
