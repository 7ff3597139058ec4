"""What an extractor gives: keypoints and descriptors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Local features of one image.

    Attributes:
        points: N×2 float32, pixel centres at integer coordinates.
        scales: N float32, diameter of the described neighbourhood [px].
        responses: N float32, strength of the keypoint, larger is stronger.
        descriptors: N×D, float32 (compared by L2) or uint8 bit strings (compared by Hamming).
    """

    points: NDArray[np.float32]
    scales: NDArray[np.float32]
    responses: NDArray[np.float32]
    descriptors: NDArray[np.float32] | NDArray[np.uint8]

    def __post_init__(self) -> None:
        n = len(self.points)
        if self.points.shape != (n, 2) or self.descriptors.ndim != 2:
            raise InvalidInputError(
                f"features need N×2 points and N×D descriptors, got shapes "
                f"{self.points.shape} and {self.descriptors.shape}"
            )
        if not len(self.scales) == len(self.responses) == len(self.descriptors) == n:
            raise InvalidInputError(
                f"features need one scale, response and descriptor a point, got "
                f"{n} points, {len(self.scales)} scales, {len(self.responses)} responses and "
                f"{len(self.descriptors)} descriptors"
            )

    def __len__(self) -> int:
        return len(self.points)

    def select(self, keep: NDArray[np.bool_] | NDArray[np.intp]) -> Features:
        """The features at a mask or at indices."""
        return Features(
            self.points[keep], self.scales[keep], self.responses[keep], self.descriptors[keep]
        )


class Extractor(Protocol):
    """Finds keypoints in a grey image and describes them.

    Attributes:
        name: as in `DetectorConfig.extractor` and on the command line.
        is_binary: whether descriptors are bit strings (Hamming) rather than vectors (L2).
    """

    @property
    def name(self) -> str: ...  # noqa: D102 - documented above
    @property
    def is_binary(self) -> bool: ...  # noqa: D102

    def extract(self, gray: NDArray[np.uint8]) -> Features:
        """Features of an H×W uint8 image; zero features where there is nothing to find."""
        ...
