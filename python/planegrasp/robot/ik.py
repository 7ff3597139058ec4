"""What inverse kinematics is asked and answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Float64Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class IKConfig:
    """How inverse kinematics searches.

    Attributes:
        position_tolerance: largest position error of a solution [m].
        rotation_tolerance: largest rotation error of a solution [rad].
        solutions: distinct solutions after which it stops.
        starts: tried until it stops with the solutions found, at least one.
        hopeless_starts: tried before it says that there is none.
    """

    position_tolerance: float = 2e-5
    rotation_tolerance: float = 5e-5
    solutions: int = 4
    starts: int = 6
    hopeless_starts: int = 12


@dataclass(frozen=True, slots=True, eq=False)
class IKSolution:
    """Joint positions that bring the gripper to its target.

    Attributes:
        q: n [rad or m]; continuous joints within half a turn of the start.
        position_error: [m].
        rotation_error: [rad].
        limit_margin: see `Kinematics.limit_margin`.
        distance: largest change of a joint from the start [rad or m].
    """

    q: Float64Array
    position_error: float
    rotation_error: float
    limit_margin: float
    distance: float


@dataclass(frozen=True, slots=True, eq=False)
class IKResult:
    """Solutions, nearest to the start first; falsy without any.

    Attributes:
        solutions: distinct ones.
        q: the first solution, or else the closest that was reached, n [rad or m].
        position_error: of q [m].
        rotation_error: of q [rad].
        reason: why there is no solution, else empty.
    """

    solutions: tuple[IKSolution, ...]
    q: Float64Array
    position_error: float
    rotation_error: float
    reason: str = ""

    def __bool__(self) -> bool:
        return bool(self.solutions)
