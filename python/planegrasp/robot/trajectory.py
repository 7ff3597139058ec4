"""When the arm passes where: as fast along a path as its joints may."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from planegrasp.robot.path import Path

    Float64Array = NDArray[np.float64]

# Points per point of the path, at which velocities and accelerations are limited.
_FINER = 4
# Half of the acceleration is for bends, half for speeding up and slowing down.
_SHARE = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Joint positions and velocities over time, at rest at both ends.

    Attributes:
        times: m, from 0, increasing [s].
        q: m×n [rad or m].
        velocities: m×n [rad/s or m/s].
    """

    times: Float64Array
    q: Float64Array
    velocities: Float64Array

    @property
    def duration(self) -> float:
        """From start to end [s]."""
        return float(self.times[-1])

    def sample(self, t: ArrayLike) -> Float64Array:
        """Joint positions at a time, n, or at k times, k×n; before and after: those of the ends."""
        return self._at(t, 0)

    def velocity(self, t: ArrayLike) -> Float64Array:
        """Joint velocities, likewise; zero before and after."""
        instants = np.asarray(t, dtype=np.float64)
        moving = (instants >= 0) & (instants <= self.duration)
        return np.where(moving[..., None], self._at(t, 1), 0.0)

    def _at(self, t: ArrayLike, derivative: int) -> Float64Array:
        instants = np.clip(np.asarray(t, dtype=np.float64), 0.0, self.duration)
        if len(self.times) == 1:
            still = self.q if derivative == 0 else np.zeros_like(self.q)
            return np.broadcast_to(still[0], (*instants.shape, self.q.shape[1])).copy()
        curve = CubicHermiteSpline(self.times, self.q, self.velocities)
        return np.asarray(curve(instants, nu=derivative), dtype=np.float64)


def time_parameterise(
    path: Path,
    velocity_limits: ArrayLike,
    acceleration_limits: ArrayLike,
    *,
    speed: float = 1.0,
) -> Trajectory:
    """Follow a path as fast as limits allow, from rest to rest.

    The speed along the path is limited at each of its points by the joints' velocities and by the
    accelerations that its bends need, and then forwards and backwards by the accelerations that are
    left (the two passes of Bobrow, Dubowsky and Gibson, 1985, with fixed shares of the
    acceleration).

    Args:
        path: dense, with round corners: a sharp one is passed slowly.
        velocity_limits: n, or one for all [rad/s or m/s].
        acceleration_limits: n, or one for all [rad/s² or m/s²].
        speed: share of the velocity limits to use, in (0, 1].
    """
    points = _without_repeats(path.q)
    n = points.shape[1]
    velocities = _limits(velocity_limits, n, "velocity_limits") * speed
    accelerations = _limits(acceleration_limits, n, "acceleration_limits")
    if not 0 < speed <= 1:
        raise InvalidInputError(f"speed must be in (0, 1], got {speed}")
    if len(points) == 1:
        return Trajectory(np.zeros(1), points, np.zeros_like(points))
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    curve = CubicSpline(knots, points, bc_type="natural")
    s = np.interp(
        np.linspace(0, len(knots) - 1, _FINER * (len(knots) - 1) + 1), range(len(knots)), knots
    )
    tangent, bend = np.abs(curve(s, nu=1)), np.abs(curve(s, nu=2))
    tiny = 1e-12
    fastest = np.min(velocities / np.maximum(tangent, tiny), axis=1)
    in_bends = np.min(_SHARE * accelerations / np.maximum(bend, tiny), axis=1)
    squared = np.minimum(fastest**2, in_bends)
    squared[0] = squared[-1] = 0.0
    gain = np.min((1 - _SHARE) * accelerations / np.maximum(tangent, tiny), axis=1)
    ds = np.diff(s)
    gain_between = np.minimum(gain[:-1], gain[1:])
    for i in range(len(ds)):
        squared[i + 1] = min(squared[i + 1], squared[i] + 2 * gain_between[i] * ds[i])
    for i in reversed(range(len(ds))):
        squared[i] = min(squared[i], squared[i + 1] + 2 * gain_between[i] * ds[i])
    rate = np.sqrt(squared)
    times = np.concatenate([[0.0], np.cumsum(2 * ds / (rate[:-1] + rate[1:]))])
    return Trajectory(times, curve(s), curve(s, nu=1) * rate[:, None])


def _without_repeats(q: Float64Array) -> Float64Array:
    keep = np.concatenate([[True], np.abs(np.diff(q, axis=0)).max(axis=1, initial=0.0) > 1e-9])
    return np.array(q[keep])


def _limits(values: ArrayLike, n: int, what: str) -> Float64Array:
    limits = np.asarray(values, dtype=np.float64)
    if limits.shape not in ((), (n,)) or not np.all(np.isfinite(limits)) or np.any(limits <= 0):
        raise InvalidInputError(
            f"{what} must be > 0, one for all joints or {n}, got {limits.tolist()}"
        )
    return np.broadcast_to(limits, (n,)).copy()
