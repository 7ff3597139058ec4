"""Feature extractors behind one small protocol."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planegrasp.errors import InvalidInputError
from planegrasp.features.akaze import AKAZE, AKAZEConfig
from planegrasp.features.base import Extractor, Features
from planegrasp.features.brisk import BRISK, BRISKConfig
from planegrasp.features.opencv_sift import OpenCVSIFT, OpenCVSIFTConfig
from planegrasp.features.orb import ORB, ORBConfig
from planegrasp.features.sift import SIFT, SIFTConfig
from planegrasp.features.surf import SURF, SURFConfig

if TYPE_CHECKING:
    from collections.abc import Callable

EXTRACTORS: dict[str, Callable[[], Extractor]] = {
    "sift": SIFT,
    "surf": SURF,
    "akaze": AKAZE,
    "brisk": BRISK,
    "orb": ORB,
    "opencv-sift": OpenCVSIFT,
}

__all__ = [
    "AKAZE",
    "BRISK",
    "EXTRACTORS",
    "ORB",
    "SIFT",
    "SURF",
    "AKAZEConfig",
    "BRISKConfig",
    "Extractor",
    "Features",
    "ORBConfig",
    "OpenCVSIFT",
    "OpenCVSIFTConfig",
    "SIFTConfig",
    "SURFConfig",
    "make_extractor",
]


def make_extractor(name: str) -> Extractor:
    """The extractor of that name with its default settings.

    Raises:
        InvalidInputError: there is none of that name.
    """
    try:
        return EXTRACTORS[name]()
    except KeyError:
        raise InvalidInputError(
            f"no extractor is called {name!r}; there are {', '.join(EXTRACTORS)}"
        ) from None
