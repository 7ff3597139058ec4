"""One frame of an RGB-D camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.errors import CameraError, DepthError, ImageError

if TYPE_CHECKING:
    from typing import Any, TypeVar

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera

    Float = TypeVar("Float", bound=NDArray[Any])

# No RGB-D camera measures farther than this; median depths beyond are millimetres by mistake.
_FARTHEST_METRES = 50.0
# Every so many rows and columns are looked at to tell metres from millimetres.
_SAMPLED = 8


@dataclass(frozen=True, slots=True, eq=False)
class RGBDFrame:
    """A colour image with depth aligned to it, and the camera that took them.

    Attributes:
        color: H×W×3 uint8, RGB.
        depth: H×W float32 metres along the optical axis, 0 = no measurement; or None.
        camera: intrinsics of the colour image.
        name: what to call the frame in outputs, for example its file name.
        timestamp: seconds, or None.

    Depth that is not finite or is negative counts as no measurement and is set to 0, in a copy.
    Images that can be used as they are are not copied: leave their arrays alone afterwards.

    Raises:
        ImageError: color is not H×W×3 uint8.
        CameraError: the camera is for another image size.
        DepthError: depth has another size than colour, is not floating point, or is not in metres.
    """

    color: NDArray[np.uint8]
    depth: NDArray[np.float32] | None
    camera: PinholeCamera
    name: str = ""
    timestamp: float | None = None

    def __post_init__(self) -> None:
        color = check_color(self.color)
        height, width = color.shape[:2]
        if (width, height) != (self.camera.width, self.camera.height):
            raise CameraError(
                f"the camera is for {self.camera.width}×{self.camera.height} images, "
                f"this image is {width}×{height}"
            )
        object.__setattr__(self, "color", color)
        if self.depth is not None:
            object.__setattr__(self, "depth", _check_depth(self.depth, (height, width)))

    @property
    def has_depth(self) -> bool:
        """Whether at least one pixel has a depth measurement."""
        return self.depth is not None and bool(np.any(self.depth > 0))


def check_color(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the image as a C-contiguous array, or raise ImageError if it is not H×W×3 uint8."""
    array = np.asarray(image)
    if array.dtype != np.uint8:
        raise ImageError(f"a colour image is uint8 (0 … 255), got {array.dtype}")
    if array.ndim != 3 or array.shape[2] != 3:
        raise ImageError(f"a colour image is H×W×3 (RGB), got shape {array.shape}")
    if array.shape[0] < 1 or array.shape[1] < 1:
        raise ImageError(f"the image is empty: shape {array.shape}")
    return np.ascontiguousarray(array)


def _check_depth(depth: NDArray[np.float32], shape: tuple[int, int]) -> NDArray[np.float32]:
    array = np.asarray(depth)
    if array.shape != shape:
        raise DepthError(
            f"depth must be aligned to colour, {shape[1]}×{shape[0]}, got shape {array.shape}"
        )
    if not np.issubdtype(array.dtype, np.floating):
        raise DepthError(
            f"depth is float32 metres, got {array.dtype}: convert it first, for millimetres "
            f"depth.astype(np.float32) / 1000"
        )
    # Most images need no more than a look at their extremes; comparisons with NaN are false.
    if array.size and array.min() >= 0 and array.max() <= _FARTHEST_METRES:
        return np.ascontiguousarray(array, dtype=np.float32)
    clean = measured(array)
    # A sample tells the unit; the median of all pixels would take longer than tracking does.
    sample = clean[::_SAMPLED, ::_SAMPLED]
    if not sample.any():
        sample = clean
    sample = sample[sample > 0]
    if sample.size and (median := float(np.median(sample))) > _FARTHEST_METRES:
        raise DepthError(
            f"depth must be in metres, but its median is {median:.6g}: "
            f"that looks like millimetres, divide by 1000"
        )
    return np.ascontiguousarray(clean, dtype=np.float32)


def measured(depth: Float) -> Float:
    """A copy of a depth image in which what is not finite or is negative is 0."""
    clean: Float = np.fmax(depth, 0)  # 0 of NaN and 0; far faster than a mask
    if clean.size and np.isinf(clean.max()):
        clean[np.isinf(clean)] = 0
    return clean
