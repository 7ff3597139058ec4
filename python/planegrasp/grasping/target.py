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
        forgiven: sightings in a row that contradict the motion until they are believed.
    """

    def __init__(
        self, sighting: Sighting, config: PoseFilterConfig | None = None, *, forgiven: int = 3
    ) -> None:
        self._config = config or PoseFilterConfig()
        self._forgiven = forgiven
        self._refused = 0
        self._state = self._start(sighting)

    def update(self, eyes: Eyes) -> bool:
        """Take in what the eyes have seen since; whether the object was seen where expected."""
        sighting = eyes.look()
        if sighting is None or sighting.time < self._state.time:
            return False
        predicted = predict(self._state, sighting.time, self._config)
        corrected = correct(predicted, sighting.T_base_object, sighting.covariance, self._config)
        if corrected is not None:
            self._state, self._refused = corrected, 0
            return True
        self._refused += 1
        if self._refused >= self._forgiven:
            self._state, self._refused = self._start(sighting), 0
        return False

    @property
    def seen(self) -> float:
        """When it was last seen where expected [s]."""
        return self._state.time

    def at(self, time: float) -> RigidTransform:
        """T_base_object at a time not before it was last seen [s]."""
        return predict(self._state, time, self._config).T_base_object

    def sigma(self, time: float) -> float:
        """Largest standard deviation of its position at a time [m]."""
        covariance = predict(self._state, time, self._config).covariance
        return math.sqrt(float(np.linalg.eigvalsh(covariance[:3, :3])[-1]))

    def _start(self, sighting: Sighting) -> FilteredPose:
        return first_pose(sighting.time, sighting.T_base_object, sighting.covariance, self._config)
