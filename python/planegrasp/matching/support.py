"""Which matches agree with others about how the face is turned, scaled and placed.

A keypoint has a position, a scale and an orientation, and its oblique view a direction and a tilt:
together a local affine map from the reference into the frame. Where that map predicts another
match, the two support each other. Weak, blurred or small faces have few right matches among many;
support finds them where the ratio test alone cannot (after the pose clustering of Lowe, IJCV 2004,
with affine instead of similarity frames).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.matching.index import Matches

# Pairs are compared with each other: so many matches at most, the best by ratio.
_MOST_MATCHES = 250
# A local map may be off by this share of the distance that it predicts over, and by so many pixels.
_TOLERANCE = 0.3
_TOLERANCE_PX = 4.0
# Frobenius distance of one local map, seen from the other, to the identity.
_MAP_TOLERANCE = 0.8
# Matches supported by fewer others are dropped.
_MIN_SUPPORT = 2


def supported(matches: Matches) -> tuple[Matches, NDArray[np.intp]]:
    """The matches that others support.

    Args:
        matches: of a frame with one face.

    Returns:
        The matches with enough support, and by how many others each is supported.
    """
    if len(matches) > _MOST_MATCHES:
        best = np.argsort(matches.ratio, kind="stable")[:_MOST_MATCHES]
        matches = matches.select(best)
    local, inverse = matches.affine, np.linalg.inv(matches.affine)
    between = matches.reference_points[None] - matches.reference_points[:, None]
    predicted = np.einsum("iab,ijb->ija", local, between)
    measured = matches.image_points[None] - matches.image_points[:, None]
    error = np.linalg.norm(predicted - measured, axis=2)
    allowed = np.maximum(_TOLERANCE_PX, _TOLERANCE * np.linalg.norm(predicted, axis=2))
    relative = np.einsum("iab,jbc->ijac", inverse, local)
    alike = np.linalg.norm(relative - np.eye(2), axis=(2, 3)) < _MAP_TOLERANCE
    # The same reference point seen twice supports nothing.
    distinct = np.linalg.norm(between, axis=2) > 1e-6
    count = np.count_nonzero((error < allowed) & alike & distinct, axis=1)
    keep = count >= _MIN_SUPPORT
    return matches.select(keep), count[keep]
