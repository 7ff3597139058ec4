"""How a hand that holds something still moves: it wanders, turns a little, and trembles."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation

Float64Array = NDArray[np.float64]

# Several waves of frequencies without a common period never repeat within an experiment.
_WAVES = 4


@dataclass(frozen=True, slots=True)
class HandMotionConfig:
    """How much a hand moves.

    Attributes:
        speed: bound of the drift's speed [m/s].
        excursion: bound of the drift's distance from where the hand rests [m].
        turn: bound of the angle by which it turns [rad].
        wander_band: lowest and highest frequency of drift and turn [Hz].
        tremor: bound of the tremor's distance from the drift [m].
        tremor_band: physiological tremor is one of 8 to 12 Hz [Hz].
        tremor_onset: time from rest until it trembles fully [s].

    Raises:
        InvalidInputError: a bound is negative, or a band empty.
    """

    speed: float = 0.1
    excursion: float = 0.08
    turn: float = np.radians(5.0)
    wander_band: tuple[float, float] = (0.15, 0.6)
    tremor: float = 0.001
    tremor_band: tuple[float, float] = (8.0, 12.0)
    tremor_onset: float = 0.5

    def __post_init__(self) -> None:
        for name in ("speed", "excursion", "turn", "tremor", "tremor_onset"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise InvalidInputError(f"{name} of a hand must be ≥ 0 and finite, got {value}")
        for name in ("wander_band", "tremor_band"):
            low, high = getattr(self, name)
            if not 0 < low < high:
                raise InvalidInputError(f"{name} must be 0 < low < high Hz, got {low} … {high}")


class HandMotion:
    """A random motion, the same for the same seed; it starts at rest at t = 0."""

    def __init__(
        self,
        rest: RigidTransform,
        rng: np.random.Generator,
        config: HandMotionConfig | None = None,
    ) -> None:
        """Draw a motion.

        Args:
            rest: T_base_hand at t = 0.
            rng: draws frequencies and directions.
            config: defaults where None.
        """
        config = config or HandMotionConfig()
        self.rest = rest
        self.config = config
        # Half of 1 - cos(2πft) is in 0 … 1 and changes by at most πf a second.
        self._drift_hz, drift = _waves(rng, config.wander_band)
        farthest = _longest_sum(drift, (0.0, 1.0))
        fastest = _longest_sum(np.pi * self._drift_hz[:, None] * drift, (-1.0, 1.0))
        self._drift = min(config.excursion / farthest, config.speed / fastest) * drift
        self._turn_hz, turn = _waves(rng, config.wander_band)
        self._turn = config.turn / _longest_sum(turn, (0.0, 1.0)) * turn
        self._tremor_hz, tremor = _waves(rng, config.tremor_band)
        self._tremor = config.tremor / _longest_sum(tremor, (-1.0, 1.0)) * tremor

    def pose(self, t: float) -> RigidTransform:
        """T_base_hand at a time [s] from 0 on."""
        drift = self.drift(t)
        return RigidTransform.from_components(
            drift.translation + self._trembling(t), drift.rotation
        )

    def drift(self, t: float) -> RigidTransform:
        """`pose` without the tremor: what the bounds of speed and excursion are of."""
        offset = _raised(self._drift_hz, t) @ self._drift
        turn = Rotation.from_rotvec(_raised(self._turn_hz, t) @ self._turn)
        return RigidTransform.from_components(
            self.rest.translation + offset, turn * self.rest.rotation
        )

    def _trembling(self, t: float) -> Float64Array:
        onset = self.config.tremor_onset
        share = min(max(t / onset, 0.0), 1.0) if onset > 0 else 1.0
        strength = share * share * (3.0 - 2.0 * share)
        waves = np.sin(2.0 * np.pi * self._tremor_hz * t)
        return np.asarray(strength * (waves @ self._tremor), dtype=np.float64)


def _raised(frequencies: Float64Array, t: float) -> Float64Array:
    """Waves between 0 and 1 that start at 0, at rest."""
    return np.asarray(0.5 - 0.5 * np.cos(2.0 * np.pi * frequencies * t), dtype=np.float64)


def _waves(
    rng: np.random.Generator, band: tuple[float, float]
) -> tuple[Float64Array, Float64Array]:
    """Frequencies [Hz], and a random vector for each."""
    return rng.uniform(*band, _WAVES), rng.normal(size=(_WAVES, 3))


def _longest_sum(vectors: Float64Array, ends: tuple[float, float]) -> float:
    """The longest sum of vectors, each times a factor between the ends.

    Length is convex, so the longest has every factor at an end. Waves without a common period come
    as near to it as one likes, if one waits.
    """
    factors = np.array(list(product(ends, repeat=len(vectors))))
    return float(np.linalg.norm(factors @ vectors, axis=1).max())
