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
        angles: N float32, orientation of the neighbourhood [rad], from x towards y (clockwise).
        responses: N float32, strength of the keypoint, larger is stronger.
        descriptors: N×D, float32 or uint8 vectors (compared by L2) or uint8 bit strings (compared
            by Hamming); the extractor says which.
        signs: N int8, sign of the Laplacian: 1 = darker than what is about it, -1 = brighter, 0 =
            unknown. Only keypoints of one sign look alike (Bay et al., CVIU 2008, section 4.3), so
            that the native matcher compares no others, 0 with 0 only. None: all 0.
    """

    points: NDArray[np.float32]
    scales: NDArray[np.float32]
    angles: NDArray[np.float32]
    responses: NDArray[np.float32]
    descriptors: NDArray[np.float32] | NDArray[np.uint8]
    signs: NDArray[np.int8] | None = None

    def __post_init__(self) -> None:
        n = len(self.points)
        if self.points.shape != (n, 2) or self.descriptors.ndim != 2:
            raise InvalidInputError(
                f"features need N×2 points and N×D descriptors, got shapes "
                f"{self.points.shape} and {self.descriptors.shape}"
            )
        lengths = [len(a) for a in (self.scales, self.angles, self.responses, self.descriptors)]
        if any(length != n for length in lengths):
            raise InvalidInputError(
                f"features need one scale, angle, response and descriptor a point, got "
                f"{n} points and {lengths} of those"
            )
        if self.signs is not None and len(self.signs) != n:
            raise InvalidInputError(
                f"features need one sign a point, got {len(self.signs)} for {n}"
            )

    def __len__(self) -> int:
        return len(self.points)

    @property
    def frames(self) -> NDArray[np.float64]:
        """N×2×2: scaled rotations from a keypoint's own frame to the image."""
        cosine, sine = np.cos(self.angles, dtype=float), np.sin(self.angles, dtype=float)
        rotation = np.stack([np.stack([cosine, -sine], -1), np.stack([sine, cosine], -1)], -2)
        return np.asarray(self.scales[:, None, None] * rotation, dtype=np.float64)

    def select(self, keep: NDArray[np.bool_] | NDArray[np.intp]) -> Features:
        """The features at a mask or at indices."""
        return Features(
            self.points[keep],
            self.scales[keep],
            self.angles[keep],
            self.responses[keep],
            self.descriptors[keep],
            None if self.signs is None else self.signs[keep],
        )


class Extractor(Protocol):
    """Finds keypoints in a grey image and describes them.

    Attributes:
        name: as in `DetectorConfig.extractor` and on the command line.
        is_binary: whether descriptors are bit strings (Hamming) rather than vectors (L2).
        farthest: distance of two descriptors from which on they are not alike; may be infinite.
    """

    @property
    def name(self) -> str: ...  # noqa: D102 - documented above
    @property
    def is_binary(self) -> bool: ...  # noqa: D102
    @property
    def farthest(self) -> float: ...  # noqa: D102

    def extract(self, gray: NDArray[np.uint8]) -> Features:
        """Features of an H×W uint8 image; zero features where there is nothing to find."""
        ...
