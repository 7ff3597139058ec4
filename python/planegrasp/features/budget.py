"""A keypoint budget that is spread over the image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planegrasp.features.base import Features

# Cells along the longer side of the image.
_CELLS = 16


def spread(features: Features, budget: int, size: tuple[int, int]) -> Features:
    """Keep at most `budget` features, the strongest of each cell of a grid.

    Keeping the strongest of the whole image instead would let a busy background crowd out a
    weakly textured object.

    Args:
        features: of one image.
        budget: how many to keep; 0 keeps all.
        size: width and height of the image [px].
    """
    if not budget or len(features) <= budget:
        return features
    cell_side = max(size) / _CELLS
    columns = int(np.ceil(size[0] / cell_side))
    grid = np.floor(features.points / cell_side).astype(np.int64)
    cell = grid[:, 1] * columns + grid[:, 0]
    # Rank of each feature within its cell, strongest first; low ranks are kept everywhere first.
    order = np.lexsort((-features.responses, cell))
    starts = np.flatnonzero(np.r_[True, np.diff(cell[order]) != 0])
    lengths = np.diff(np.r_[starts, len(order)])
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order)) - np.repeat(starts, lengths)
    keep = np.lexsort((-features.responses, rank))[:budget]
    return features.select(np.sort(keep))
