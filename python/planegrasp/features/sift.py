"""SIFT (Lowe, IJCV 2004) with RootSIFT descriptors (Arandjelović & Zisserman, CVPR 2012)."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

from planegrasp import _core
from planegrasp.features._opencv import check_gray
from planegrasp.features.base import Features

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_DEFAULTS = _core.Sift.defaults()


@dataclass(frozen=True, slots=True)
class SIFTConfig:
    """Settings of SIFT.

    Attributes:
        max_features: a budget, spread over the image; 0 = all.
        octave_layers: scales an octave (Lowe: 3).
        contrast_threshold: of the extrema, in OpenCV's unit (its default is 0.04). The lower
            value finds faces with weak texture.
        edge_threshold: largest ratio of principal curvatures (Lowe: 10).
        sigma: blur of the first scale [px] (Lowe: 1.6).
        double_first_octave: begin at twice the resolution of the image (Lowe: yes). Without, it is
            about three times faster and finds no keypoints smaller than about 4 px.
    """

    max_features: int = _DEFAULTS["max_features"]
    octave_layers: int = _DEFAULTS["octave_layers"]
    contrast_threshold: float = _DEFAULTS["contrast_threshold"]
    edge_threshold: float = _DEFAULTS["edge_threshold"]
    sigma: float = _DEFAULTS["sigma"]
    double_first_octave: bool = _DEFAULTS["double_first_octave"]


@dataclass(frozen=True, slots=True)
class SIFT:
    """The Rust core's SIFT; it keeps its memory between images of the same size.

    Attributes:
        config: its settings.
        threads: how many it runs on, 0 = all of the machine. The features do not depend on it.
        name: see `Extractor`.
        farthest: see `Extractor`; 99 % of the right matches are nearer, and nearly half of the
            features that show something else have no neighbour.
        is_binary: see `Extractor`; descriptors are unit vectors in units of 1/255, as bytes.

    Raises:
        InvalidInputError: a setting is out of its range.
    """

    config: SIFTConfig = SIFTConfig()
    # Not part of what is printed, and so not of the key of cached features.
    threads: int = field(default=0, repr=False, compare=False)
    name: str = "sift"
    is_binary: bool = False
    farthest: float = 140.0
    _core: _core.Sift = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_core", _core.Sift(**asdict(self.config), threads=self.threads))

    def __reduce__(self) -> tuple[type[SIFT], tuple[SIFTConfig, int]]:
        """Copies and pickles begin with fresh memory."""
        return SIFT, (self.config, self.threads)

    def extract(self, gray: NDArray[np.uint8]) -> Features:
        """Features of an H×W uint8 image; descriptors are N×128 uint8, at most 127.

        Raises:
            ImageError: the image is not H×W uint8.
            InvalidInputError: it has more than 2²⁶ pixels, or 65536 along one side.
        """
        return Features(*self._core.extract(check_gray(gray)))
