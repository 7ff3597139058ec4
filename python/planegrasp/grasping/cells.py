"""Points in cells of a grid around a box, and few boxes around the cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.body import BoxBody

    Points = NDArray[np.float64]
    Cells = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Cells of about one size along the axes of a body, none of which straddles its sides.

    Attributes:
        edges: for each axis where its cells begin and end [m], increasing.
    """

    edges: tuple[Points, Points, Points]

    @classmethod
    def around(cls, body: BoxBody, reach: float, size: float) -> Grid:
        """Cells of a size [m] up to a distance of at least `reach` from the body's middle [m]."""
        half = np.asarray(body.size) / 2
        edges = []
        for axis in range(3):
            inside = np.linspace(-half[axis], half[axis], int(np.ceil(2 * half[axis] / size)) + 1)
            count = max(1, int(np.ceil((reach - half[axis]) / size)))
            outside = half[axis] + size * np.arange(1, count + 1)
            edges.append(np.concatenate([-outside[::-1], inside, outside]) + body.centre[axis])
        return cls((edges[0], edges[1], edges[2]))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of cells along each axis."""
        x, y, z = (len(edges) - 1 for edges in self.edges)
        return x, y, z

    def cells(self, points: Points) -> Cells:
        """For each of N points the number of its cell, -1 outside of the grid."""
        index = np.stack(
            [np.searchsorted(e, points[:, i], "right") - 1 for i, e in enumerate(self.edges)]
        )
        inside = np.all((index >= 0) & (index < np.reshape(self.shape, (3, 1))), axis=0)
        flat = np.full(len(points), -1)
        flat[inside] = np.ravel_multi_index(tuple(index[:, inside]), self.shape)
        return flat


def boxes_around(points: Points, grid: Grid) -> tuple[Points, Points]:
    """Boxes that have each of N points within a grid in one of them.

    Filled cells that lie side by side are joined to blocks, the largest that greed finds, and each
    block is drawn in to the points in it.

    Returns:
        Lowest and highest corners of the boxes, M×3 each [m].
    """
    flat = grid.cells(points)
    points, flat = points[flat >= 0], flat[flat >= 0]
    filled = np.zeros(grid.shape, dtype=bool)
    filled.flat[flat] = True
    owner = np.full(grid.shape, -1)
    count = 0
    for part in ndimage.find_objects(ndimage.label(filled)[0]):
        count = _blocks(filled[part], owner[part], count)
    if count == 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    block = owner.flat[flat]
    order = np.argsort(block, kind="stable")
    starts = np.searchsorted(block[order], np.arange(count))
    sorted_points = points[order]
    return (
        np.minimum.reduceat(sorted_points, starts, axis=0),
        np.maximum.reduceat(sorted_points, starts, axis=0),
    )


def _blocks(filled: NDArray[np.bool_], owner: Cells, count: int) -> int:
    """Number the filled cells that nobody owns by the block they are in, from `count` on."""
    free = filled & (owner < 0)
    while free.any():
        first = np.array(np.unravel_index(int(np.argmax(free)), free.shape))
        low, high = first, first + 1
        # What stops a block on one side goes on stopping it as it grows on others.
        sides = [(axis, end) for axis in range(3) for end in (0, 1)]
        while sides:
            for axis, end in tuple(sides):
                grown = low.copy(), high.copy()
                grown[end][axis] += 2 * end - 1
                within = grown[0][axis] >= 0 and grown[1][axis] <= free.shape[axis]
                if within and free[_slices(*grown)].all():
                    low, high = grown
                else:
                    sides.remove((axis, end))
        owner[_slices(low, high)] = count
        free[_slices(low, high)] = False
        count += 1
    return count


def _slices(low: Cells, high: Cells) -> tuple[slice, slice, slice]:
    x, y, z = (slice(int(a), int(b)) for a, b in zip(low, high, strict=True))
    return x, y, z
