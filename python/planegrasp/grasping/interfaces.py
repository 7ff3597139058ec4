"""What an arm and a pair of eyes must offer so that a plan can be carried out.

`planegrasp.simulation` implements both; a driver of a real robot does likewise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from planegrasp.geometry import RigidTransform
    from planegrasp.robot.state import RobotState

    Float64Array = NDArray[np.float64]

__all__ = ["Arm", "Eyes", "Sighting"]


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """Where the object was seen.

    Attributes:
        time: when the frame was taken [s], on the arm's clock.
        T_base_object: pose in the robot's base, with the camera where it was at that time.
        covariance: 6×6 of (translation, rotation vector) in the object's frame, of what differs
            from frame to frame (`PoseEstimate.noise_covariance`).
    """

    time: float
    T_base_object: RigidTransform
    covariance: Float64Array


class Arm(Protocol):
    """An arm with a gripper, driven by joint positions."""

    @property
    def time(self) -> float:
        """The arm's clock [s]."""
        ...

    @property
    def state(self) -> RobotState:
        """Where all joints are now."""
        ...

    @property
    def is_gripping(self) -> bool:
        """Whether the fingers press on something between them."""
        ...

    def move(self, q: Float64Array) -> None:
        """Drive the arm's joints, n, to these positions [rad or m]; returns at once."""
        ...

    def grip(self, opening: float, force: float) -> None:
        """Drive the gripper to an opening [m] with at most a force [N]; returns at once."""
        ...

    def advance(self, seconds: float) -> None:
        """Let time pass: sleep, or simulate."""
        ...


class Eyes(Protocol):
    """Something that finds the object again and again."""

    def look(self) -> Sighting | None:
        """The newest sighting that was not returned yet, None where there is none; never waits."""
        ...
