"""Images as a camera with the same K and no lens distortion would have taken them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera


class Undistorted:
    """Undistorts the images of one camera; those of a camera without distortion stay as they are.

    The look-up is made once: make one object for a sequence of frames.

    Attributes:
        camera: whose images these are.
    """

    def __init__(self, camera: PinholeCamera) -> None:
        self.camera = camera
        self._maps: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None
        if camera.is_distorted:
            v, u = np.mgrid[0 : camera.height, 0 : camera.width]
            seen = camera.distort(np.column_stack([u.ravel(), v.ravel()])).astype(np.float32)
            shape = (camera.height, camera.width)
            self._maps = seen[:, 0].reshape(shape), seen[:, 1].reshape(shape)

    def image(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """H×W×3 colour or H×W grey image, black where the camera did not see."""
        if self._maps is None:
            return image
        return np.asarray(cv2.remap(image, *self._maps, cv2.INTER_LINEAR), dtype=np.uint8)

    def depth(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """H×W depth image [m], nearest measurement, 0 where the camera did not see."""
        if self._maps is None:
            return depth
        return np.asarray(cv2.remap(depth, *self._maps, cv2.INTER_NEAREST), dtype=np.float32)
