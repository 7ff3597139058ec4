"""Features of a flat reference image as it looks from oblique directions.

A planar target's oblique appearance can be made when it is taught: the reference is compressed by
tilts t = 1 / cos(angle) along several directions, and features of all these views are kept with
their positions mapped back (ASIFT: Morel & Yu, SIAM J. Imaging Sciences 2009, applied to the
reference side only, so that a frame costs nothing more).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from planegrasp.features.base import Extractor, Features


@dataclass(frozen=True, slots=True)
class ObliqueConfig:
    """Which views of the reference are made.

    Attributes:
        tilts: t = 1 / cos(out-of-plane angle); 1 is the reference itself. √2, 2, 2√2, 4, 4√2 are
            45°, 60°, 69°, 76°, 80°.
        rotation_step: views of tilt t are rotated by multiples of rotation_step / t [deg]
            (Morel & Yu: 72). Closer views find more of very oblique faces; pruning keeps the number
            of descriptors.
        blur: σ = blur·√(t² - 1) along the compressed direction before it is resampled
            (Morel & Yu: 0.8).
    """

    tilts: tuple[float, ...] = (1.0, 2**0.5, 2.0, 2 * 2**0.5, 4.0, 4 * 2**0.5)
    rotation_step: float = 50.0
    blur: float = 0.8

    def __post_init__(self) -> None:
        if not self.tilts or any(not 1.0 <= t <= 10.0 for t in self.tilts):
            raise InvalidInputError(f"tilts are ≥ 1 and ≤ 10 (1 = frontal), got {self.tilts}")
        if self.rotation_step <= 0 or self.blur < 0:
            raise InvalidInputError(
                f"rotation_step must be > 0° and blur ≥ 0, got {self.rotation_step}, {self.blur}"
            )


FRONTAL = ObliqueConfig(tilts=(1.0,))


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """One oblique view.

    Attributes:
        image: h×w uint8.
        view_from_reference: 2×3, from reference pixels to view pixels (centres at integers).
    """

    image: NDArray[np.uint8]
    view_from_reference: NDArray[np.float64]


def oblique_views(gray: NDArray[np.uint8], config: ObliqueConfig) -> Iterator[View]:
    """The views of an H×W uint8 reference, one after the other."""
    for tilt in config.tilts:
        step = config.rotation_step / tilt
        angles = np.arange(0.0, 180.0, step) if tilt > 1.0 else np.zeros(1)
        for angle in angles:
            yield oblique_view(gray, tilt, float(np.radians(angle)), config.blur)


def oblique_view(gray: NDArray[np.uint8], tilt: float, angle: float, blur: float) -> View:
    """One view of an H×W uint8 reference.

    Args:
        gray: the reference.
        tilt: t = 1 / cos(out-of-plane angle), ≥ 1.
        angle: of the direction that is compressed [rad].
        blur: see `ObliqueConfig`.
    """
    if tilt == 1.0 and angle == 0.0:
        return View(gray, np.eye(2, 3))
    height, width = gray.shape
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s], [s, c]])
    corners = np.array([[0, 0], [width - 1, 0], [width - 1, height - 1], [0, height - 1]], float)
    rotated = corners @ R.T
    low, extent = rotated.min(axis=0), np.ptp(rotated, axis=0)
    rotation = np.column_stack([R, -low])
    size = (int(np.ceil(extent[0])) + 1, int(np.ceil(extent[1])) + 1)
    turned = cv2.warpAffine(
        gray, rotation, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    sigma = blur * float(np.sqrt(tilt * tilt - 1.0))
    smooth = cv2.GaussianBlur(turned, (2 * int(np.ceil(3 * sigma)) + 1, 1), sigma, sigmaY=1.0)
    squeeze = np.array([[1.0 / tilt, 0.0, 0.0], [0.0, 1.0, 0.0]])
    # One pixel more than lie between the first centre and the last, as above: a pixel of this view
    # is several of the reference, and all of them are to be in it.
    squeezed_width = int(np.ceil(extent[0] / tilt)) + 1
    image = cv2.warpAffine(
        smooth,
        squeeze,
        (squeezed_width, size[1]),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    view_from_reference = squeeze[:, :2] @ rotation
    return View(image.astype(np.uint8), view_from_reference)


@dataclass(frozen=True, slots=True, eq=False)
class ObliqueFeatures:
    """Features of all views of a reference, mapped back to it.

    Attributes:
        points: M×2 float32, reference pixels (centres at integers).
        frames: M×2×2 float32, from each keypoint's own frame to the reference.
        descriptors: M×D.
        signs: M int8, see `Features`; 0 where the extractor says none.
    """

    points: NDArray[np.float32]
    frames: NDArray[np.float32]
    descriptors: NDArray[np.float32] | NDArray[np.uint8]
    signs: NDArray[np.int8]

    def __len__(self) -> int:
        return len(self.points)

    def select(self, keep: NDArray[np.intp]) -> ObliqueFeatures:
        """The features at indices, in their order."""
        return ObliqueFeatures(
            self.points[keep], self.frames[keep], self.descriptors[keep], self.signs[keep]
        )


def extract_oblique(
    extractor: Extractor, gray: NDArray[np.uint8], config: ObliqueConfig
) -> ObliqueFeatures:
    """Features of all views that lie on the reference."""
    parts: list[ObliqueFeatures] = []
    height, width = gray.shape
    for view in oblique_views(gray, config):
        features = extractor.extract(view.image)
        reference_from_view = np.linalg.inv(view.view_from_reference[:, :2])
        points = (features.points - view.view_from_reference[:, 2]) @ reference_from_view.T
        inside = np.all((points >= 0) & (points <= (width - 1, height - 1)), axis=1)
        parts.append(
            ObliqueFeatures(
                points[inside].astype(np.float32),
                (reference_from_view @ features.frames[inside]).astype(np.float32),
                features.descriptors[inside],
                known_signs(features)[inside],
            )
        )
    return ObliqueFeatures(
        np.concatenate([p.points for p in parts]),
        np.concatenate([p.frames for p in parts]),
        np.concatenate([p.descriptors for p in parts]),
        np.concatenate([p.signs for p in parts]),
    )


def known_signs(features: Features) -> NDArray[np.int8]:
    """The features' signs, 0 where the extractor says none."""
    return np.zeros(len(features), np.int8) if features.signs is None else features.signs
