"""Paths through joint space."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Float64Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Where the arm passes, closely enough to go straight from one point to the next.

    Attributes:
        q: m×n, m ≥ 1 [rad or m]; read-only. Continuous joints are counted on beyond ±π.
    """

    q: Float64Array

    def __post_init__(self) -> None:
        q = np.array(self.q, dtype=np.float64)
        if q.ndim != 2 or not len(q) or not np.all(np.isfinite(q)):
            raise InvalidInputError(f"a path is m×n finite joint positions, got shape {q.shape}")
        q.flags.writeable = False
        object.__setattr__(self, "q", q)

    @property
    def start(self) -> Float64Array:
        """First joint positions, n."""
        return np.array(self.q[0])

    @property
    def end(self) -> Float64Array:
        """Last joint positions, n."""
        return np.array(self.q[-1])

    @property
    def length(self) -> float:
        """Sum of the Euclidean distances between points [rad]."""
        return float(np.linalg.norm(np.diff(self.q, axis=0), axis=1).sum())

    def then(self, other: Path) -> Path:
        """This path and then another, which starts where this ends."""
        gap = float(np.abs(other.q[0] - self.q[-1]).max())
        if gap > 1e-6:
            raise InvalidInputError(f"paths must join, but there are {gap:.3g} rad between them")
        return Path(np.vstack([self.q, other.q[1:]]))

    def reversed(self) -> Path:
        """The same path back."""
        return Path(self.q[::-1])


@dataclass(frozen=True, slots=True, eq=False)
class MotionFailure:
    """Why there is no path; falsy.

    Attributes:
        reason: in words.
        fraction: how far it got, 0 … 1.
        path: until there, None where it did not begin.
        is_costly: whether it was searched for at length.
    """

    reason: str
    fraction: float = 0.0
    path: Path | None = None
    is_costly: bool = False

    def __bool__(self) -> bool:
        return False


def densify(points: Float64Array, step: float) -> Float64Array:
    """Put points between points (m×n), so that no joint moves by more than `step` at once."""
    pieces = [points[:1]]
    for before, after in itertools.pairwise(points):
        count = max(int(np.ceil(np.abs(after - before).max() / step - 1e-9)), 1)
        shares = np.arange(1, count + 1)[:, None] / count
        pieces.append(before + shares * (after - before))
    return np.vstack(pieces)


def round_corners(
    points: Float64Array, passes: int, is_free: Callable[[Float64Array], bool]
) -> Float64Array:
    """Average neighbours of a dense path (m×n) as often as the result stays free; ends stay.

    Tries `passes` passes, then a third of them, and so on.
    """
    while passes >= 1 and len(points) > 2:
        rounded = points
        for _ in range(passes):
            inner = (rounded[:-2] + 2 * rounded[1:-1] + rounded[2:]) / 4
            rounded = np.vstack([rounded[:1], inner, rounded[-1:]])
        if is_free(rounded):
            return rounded
        passes //= 3
    return points
