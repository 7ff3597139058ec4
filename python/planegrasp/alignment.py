"""Refine a verified homography on the grey values of the face, to hundredths of a pixel.

The arithmetic is the core's (rust/core/src/alignment): the reference is rendered as the frame
should show it, in tiles that each measure how far they are displaced; most of them decide.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from planegrasp import _core
from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class AlignmentConfig:
    """Settings of the alignment; the defaults suit a start from keypoint matches.

    Attributes:
        max_tiles: at most so many tiles of 8×8 pixels are compared.
        min_tiles: fewer tiles than this that agree with the reference are no evidence.
        min_correlation: tiles that correlate less with the reference show something else.
        max_motion: a corner may move this far from the start [px].
        start_sigma: standard deviation of the start's corners [px], the prior.
        displacement_floor: errors of a tile's displacement that its grey values do not show [px],
            for example because the face is not quite flat.
        max_iterations: at most so many on one rendering of the reference.
        renderings: at most so many times the reference is rendered, each by the homography found
            on the one before; at least 2.
    """

    max_tiles: int = 128
    min_tiles: int = 8
    min_correlation: float = 0.5
    max_motion: float = 20.0
    start_sigma: float = 2.0
    displacement_floor: float = 0.03
    max_iterations: int = 10
    renderings: int = 2

    def __post_init__(self) -> None:
        try:
            _core.AlignmentSettings(**asdict(self))
        except TypeError as error:
            raise InvalidInputError(f"alignment settings must be numbers: {error}") from error


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """Where an alignment ended.

    Attributes:
        homography: 3×3, reference edge coordinates to undistorted pixels, H[2, 2] = 1: the
            refined one if accepted, the start otherwise.
        score_before: mean correlation (-1 … 1) of what is seen of the face with its reference at
            the start, over the tiles of the first rendering: a third of all where these are clear.
        score_after: the same at the refined homography.
        accepted: whether the refined homography is better and within the allowed motion.
        tiles: number of tiles that agreed with the reference.
        compared: of so many.
        information: 8×8, of the corners' positions (x, y) [px], top-left, then clockwise.
    """

    homography: NDArray[np.float64]
    score_before: float
    score_after: float
    accepted: bool
    tiles: int
    compared: int
    information: NDArray[np.float64]


def prepare_alignment(gray: NDArray[np.uint8]) -> _core.AlignmentReference:
    """Prepare the reference image of a face, h×w uint8.

    Raises:
        InvalidInputError: it is no such array, or smaller than 8 px.
    """
    return _core.AlignmentReference(gray)


def align(
    reference: _core.AlignmentReference,
    frame_gray: NDArray[np.uint8],
    start: NDArray[np.float64],
    config: AlignmentConfig | None = None,
) -> Alignment | None:
    """Refine a homography on an undistorted frame.

    Args:
        reference: prepared reference.
        frame_gray: H×W uint8, C-contiguous.
        start: 3×3, reference edge coordinates to undistorted pixels.
        config: settings; the defaults where None.

    Returns:
        None where the start shows no front of the reference, or too little of its texture in the
        frame.

    Raises:
        InvalidInputError: for arrays of other shapes.
    """
    settings = _core.AlignmentSettings(**asdict(config or AlignmentConfig()))
    found = reference.align(frame_gray, start, settings)
    if found is None:
        return None
    return Alignment(
        homography=found.homography,
        score_before=found.score_before,
        score_after=found.score_after,
        accepted=found.accepted,
        tiles=found.tiles,
        compared=found.compared,
        information=found.information,
    )
