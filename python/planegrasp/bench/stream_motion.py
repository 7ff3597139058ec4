"""Movements in a rendered stream."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from planegrasp.geometry import RigidTransform, Rotation

__all__ = ["Move", "Path", "travel_time"]

# A minimum-jerk movement is this much faster in its middle than on average.
_PEAK = 1.875


@dataclass(frozen=True, slots=True)
class Move:
    """A minimum-jerk movement, as arms make it (Flash and Hogan 1985).

    Attributes:
        start, end: times [s].
        origin, goal: poses then.
    """

    start: float
    end: float
    origin: RigidTransform
    goal: RigidTransform

    def pose(self, t: float) -> RigidTransform:
        """The pose at a time [s]; origin before the start, goal after the end."""
        s = float(np.clip((t - self.start) / (self.end - self.start), 0.0, 1.0))
        share = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        a, b = self.origin, self.goal
        turn = (a.rotation.inv() * b.rotation).as_rotvec()
        return RigidTransform.from_components(
            (1.0 - share) * a.translation + share * b.translation,
            a.rotation * Rotation.from_rotvec(share * turn),
        )


@dataclass(frozen=True, slots=True)
class Path:
    """Movements one after the other; between two of them it rests where the first one ended.

    Attributes:
        rest: where it is before the first one.
        moves: in the order of time; the next one may begin elsewhere than the last one ended.
    """

    rest: RigidTransform
    moves: tuple[Move, ...] = ()

    def pose(self, t: float) -> RigidTransform:
        """The pose at a time [s]."""
        begun = bisect_right(self.moves, t, key=lambda move: move.start)
        return self.moves[begun - 1].pose(t) if begun else self.rest


def travel_time(origin: RigidTransform, goal: RigidTransform, speed: float) -> float:
    """How long a movement takes that is at most this fast [m/s]."""
    return _PEAK * float(np.linalg.norm(goal.translation - origin.translation)) / speed
