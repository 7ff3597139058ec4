"""Where all joints of a robot are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class RobotState:
    """Positions of all joints: arm, fingers, and the others (torso, head, …).

    `Robot` reads and replaces parts of it by name: `robot.arm(state)`, `robot.with_arm(state, q)`.

    Attributes:
        qpos: MuJoCo's generalised positions of the robot's model, nq [rad or m]; read-only.
    """

    qpos: NDArray[np.float64]

    def __post_init__(self) -> None:
        qpos = np.array(self.qpos, dtype=np.float64)
        if qpos.ndim != 1 or not np.all(np.isfinite(qpos)):
            raise InvalidInputError(f"joint positions must be a finite vector, got {self.qpos}")
        qpos.flags.writeable = False
        object.__setattr__(self, "qpos", qpos)
