"""What is assumed of how objects move while they are tracked.

A filter that follows a hand cannot smooth the pose of what stands still, and the other way round.
Two of them (`planegrasp.pose_filter`) run side by side, as the interacting multiple model filter
(Blom and Bar-Shalom, IEEE Transactions on Automatic Control 33(8), 1988); the arithmetic is the
core's (rust/core/src/pose_filter/modes.rs).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

from planegrasp import _core
from planegrasp.pose_filter import PoseFilterConfig

__all__ = ["MotionFilterConfig"]


@dataclass(frozen=True, slots=True)
class MotionFilterConfig:
    """What is assumed of the motion; the defaults suit what a person moves, and what stands.

    Attributes:
        moving: of something that moves.
        creep: standard deviation [m] by which the position of something still changes in a second.
        angular_creep: the same for its rotation [rad].
        still_for: how long something still stays so, about [s].
        moving_for: how long something that moves goes on moving, about [s].

    Raises:
        InvalidInputError: a setting is not positive, or not finite.
    """

    moving: PoseFilterConfig = field(
        default_factory=lambda: PoseFilterConfig(
            linear_acceleration=1.0,
            angular_acceleration=4.0,
            linear_speed=0.3,
            angular_speed=1.0,
            tremor=0.0,
            angular_tremor=0.0,
        )
    )
    creep: float = 0.00005
    angular_creep: float = 0.0003
    still_for: float = 5.0
    moving_for: float = 1.0

    def __post_init__(self) -> None:
        self.settings()

    def settings(self) -> _core.MotionSettings:
        """As the core takes them."""
        return _core.MotionSettings(
            moving=_core.PoseFilterSettings(**asdict(self.moving)),
            creep=self.creep,
            angular_creep=self.angular_creep,
            still_for=self.still_for,
            moving_for=self.moving_for,
        )
