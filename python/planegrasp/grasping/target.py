"""Where the object is by now: sightings come late, and it moves on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.pose_filter import PoseFilterConfig, correct, first_pose, predict

if TYPE_CHECKING:
    from planegrasp.geometry import RigidTransform
    from planegrasp.grasping.interfaces import Eyes, Sighting
    from planegrasp.pose_filter import FilteredPose

__all__ = ["MovingTarget"]


class MovingTarget:
    """Follows an object by what the eyes see of it.

    Args:
        sighting: the first.
        config: what is assumed of its motion.
        forgiven: sightings in a row that contradict the motion, but not each other, until they
            are believed.
    """

    def __init__(
        self, sighting: Sighting, config: PoseFilterConfig | None = None, *, forgiven: int = 3
    ) -> None:
        self._config = config or PoseFilterConfig()
        self._forgiven = forgiven
        self._state = self._start(sighting)
        # What sightings that contradict the state say, and how many of them.
        self._other: FilteredPose | None = None
        self._contradictions = 0

    def update(self, eyes: Eyes) -> bool:
        """Take in what the eyes have seen since; whether the object was seen where expected."""
        sighting = eyes.look()
        if sighting is None or sighting.time < self._state.time:
            return False
        corrected = self._corrected(self._state, sighting)
        if corrected is not None:
            self._state, self._other, self._contradictions = corrected, None, 0
            return True
        other = None if self._other is None else self._corrected(self._other, sighting)
        self._contradictions = 1 if other is None else self._contradictions + 1
        self._other = self._start(sighting) if other is None else other
        if self._contradictions >= self._forgiven:
            self._state, self._other, self._contradictions = self._other, None, 0
        return False

    @property
    def seen(self) -> float:
        """When it was last seen where expected [s]."""
        return self._state.time

    def at(self, time: float) -> RigidTransform:
        """T_base_object at a time [s]; when it was last seen, for times before that."""
        return self._at(time).T_base_object

    def sigma(self, time: float) -> float:
        """Largest standard deviation of its position at a time [m]."""
        covariance = self._at(time).covariance
        return math.sqrt(float(np.linalg.eigvalsh(covariance[:3, :3])[-1]))

    def _at(self, time: float) -> FilteredPose:
        return predict(self._state, max(time, self._state.time), self._config)

    def _corrected(self, state: FilteredPose, sighting: Sighting) -> FilteredPose | None:
        predicted = predict(state, sighting.time, self._config)
        return correct(predicted, sighting.T_base_object, sighting.covariance, self._config)

    def _start(self, sighting: Sighting) -> FilteredPose:
        return first_pose(sighting.time, sighting.T_base_object, sighting.covariance, self._config)
