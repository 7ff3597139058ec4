"""Joints that turn without end: positions that differ by whole turns are the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Float64Array = NDArray[np.float64]


def wrapped_difference(
    a: Float64Array, b: Float64Array, continuous: NDArray[np.bool_]
) -> Float64Array:
    """The way from b to a, n (or m×n); of continuous joints the shorter one, within ±π [rad]."""
    difference = a - b
    return np.where(
        continuous, difference - 2 * np.pi * np.round(difference / (2 * np.pi)), difference
    )


def nearest_turn(q: Float64Array, to: Float64Array, continuous: NDArray[np.bool_]) -> Float64Array:
    """The same joint positions, continuous ones turned to within half a turn of `to`."""
    return to + wrapped_difference(q, to, continuous)
