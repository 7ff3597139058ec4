"""What a gripper's opening is in terms of its joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planegrasp.checks import check_length
from planegrasp.errors import InvalidInputError


@dataclass(frozen=True, slots=True)
class Gripper:
    """Two or more fingers whose joints move in proportion to the opening between them.

    Attributes:
        joints: names of the finger joints.
        closed: their positions with the fingers touching [m or rad].
        opened: their positions at `max_opening`.
        max_opening: largest opening [m].
    """

    joints: tuple[str, ...]
    closed: tuple[float, ...]
    opened: tuple[float, ...]
    max_opening: float

    def __post_init__(self) -> None:
        check_length(self.max_opening, "a gripper's largest opening")

    def joint_values(self, opening: float) -> dict[str, float]:
        """Positions of the finger joints for an opening [m].

        Raises:
            InvalidInputError: for an opening that the gripper does not reach.
        """
        if not -1e-9 <= opening <= self.max_opening + 1e-9:
            raise InvalidInputError(
                f"the gripper opens 0 … {self.max_opening:.3f} m, an opening of {opening} m was "
                f"asked for"
            )
        share = min(max(opening / self.max_opening, 0.0), 1.0)
        return {
            name: closed + share * (opened - closed)
            for name, closed, opened in zip(self.joints, self.closed, self.opened, strict=True)
        }

    def opening(self, joint_values: dict[str, float]) -> float:
        """Opening [m] at given joint positions: the fingers' average."""
        shares = [
            (joint_values[name] - closed) / (opened - closed)
            for name, closed, opened in zip(self.joints, self.closed, self.opened, strict=True)
        ]
        return float(np.mean(shares)) * self.max_opening
