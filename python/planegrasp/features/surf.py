"""SURF (Bay, Ess, Tuytelaars & Van Gool, CVIU 2008)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planegrasp import _core
from planegrasp.features._opencv import check_gray
from planegrasp.features.base import Features

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class SURFConfig:
    """Settings of SURF.

    Attributes:
        hessian_threshold: smallest determinant of the Hessian [grey levels²], of second
            derivatives that are divided by the area of their filter; lower finds more.
        octaves: of the scale space, 1 to 5.
        octave_layers: scales an octave in which keypoints are sought, 1 to 4 (the paper: 2).
        extended: descriptors of 128 numbers instead of 64.
        upright: no orientation; for objects that are never turned.
        max_features: a budget, spread over the image; 0 = all.
    """

    hessian_threshold: float = 4.0
    octaves: int = 4
    octave_layers: int = 2
    extended: bool = False
    upright: bool = False
    max_features: int = 4000


@dataclass(frozen=True, slots=True)
class SURF:
    """SURF of our own.

    Raises:
        InvalidInputError: a setting lies outside of its range.
    """

    config: SURFConfig = SURFConfig()
    name: str = "surf"
    is_binary: bool = False
    farthest: float = math.inf
    _extractor: _core.Surf = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        c = self.config
        extractor = _core.Surf(
            hessian_threshold=c.hessian_threshold,
            octaves=c.octaves,
            octave_layers=c.octave_layers,
            extended=c.extended,
            upright=c.upright,
            max_features=c.max_features,
        )
        object.__setattr__(self, "_extractor", extractor)

    def extract(self, gray: NDArray[np.uint8]) -> Features:
        """Features of an H×W uint8 image; descriptors are N×64 or N×128 uint8, compared by L2.

        A keypoint's scale is the side of the square that is described, 20 times the standard
        deviation of the Gaussian that the detecting filter stands for.
        """
        return Features(*self._extractor.extract(check_gray(gray)))
