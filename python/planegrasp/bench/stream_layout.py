"""Where the objects of a rendered stream are: a region of the image each, and ways out of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planegrasp.bench.scenes import CAMERA
from planegrasp.errors import InvalidInputError

# Columns and rows of regions by number of objects. Those that touch no border of the image stay
# empty, for nothing could leave them without passing before another one.
_GRIDS = {1: (1, 1), 3: (3, 1), 10: (4, 3)}
# Between a region and what is in it [px].
_MARGIN = 2.0


@dataclass(frozen=True, slots=True)
class Side:
    """A border of the image that a region touches: axis 0 is x, 1 is y; sign is outwards."""

    axis: int
    sign: int


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle of the image, as slopes x/z and y/z of the rays through its borders.

    Attributes:
        low: least slopes in x and y.
        high: greatest slopes in x and y.
        sides: borders of the image that it touches.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    sides: tuple[Side, ...]

    def room(self, z: float) -> float:
        """Radius of the largest sphere at a depth that is seen inside of the region [m]."""
        return min(
            z * (high - low) / (_secant(low) + _secant(high))
            for low, high in zip(self.low, self.high, strict=True)
        )

    def bounds(self, axis: int, z: float, radius: float) -> tuple[float, float]:
        """Least and greatest coordinate of a sphere's centre that is seen inside [m]."""
        low, high = self.low[axis], self.high[axis]
        return low * z + radius * _secant(low), high * z - radius * _secant(high)

    def outside(self, side: Side, z: float, radius: float) -> float:
        """Coordinate along the side's axis of a sphere's centre that has just left [m]."""
        border = (self.high if side.sign > 0 else self.low)[side.axis]
        return border * z + side.sign * radius * _secant(border)


def regions(objects: int) -> tuple[Region, ...]:
    """One region an object, all of one size; they do not overlap.

    Raises:
        InvalidInputError: there is no layout for that many objects.
    """
    if objects not in _GRIDS:
        raise InvalidInputError(f"a stream has 1, 3 or 10 objects, got {objects}")
    columns, rows = _GRIDS[objects]
    width, height = CAMERA.width / columns, CAMERA.height / rows
    found = []
    for row in range(rows):
        for column in range(columns):
            touched = (
                (column == 0, Side(0, -1)),
                (column == columns - 1, Side(0, 1)),
                (row == 0, Side(1, -1)),
                (row == rows - 1, Side(1, 1)),
            )
            sides = tuple(side for touches, side in touched if touches)
            if sides:
                low = _slopes(column * width + _MARGIN, row * height + _MARGIN)
                high = _slopes((column + 1) * width - _MARGIN, (row + 1) * height - _MARGIN)
                found.append(Region(low, high, sides))
    return tuple(found)


def _slopes(x: float, y: float) -> tuple[float, float]:
    """Slopes of the ray through a point of the image in edge coordinates."""
    return (x - 0.5 - CAMERA.cx) / CAMERA.fx, (y - 0.5 - CAMERA.cy) / CAMERA.fy


def _secant(slope: float) -> float:
    return float(np.hypot(1.0, slope))
