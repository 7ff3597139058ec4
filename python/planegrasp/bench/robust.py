"""The robust homography estimators that `bench estimators` compares, all with the same limits.

Each takes N×2 source and N×2 target points, the best match first, and gives a 3×3 homography or
None. An inlier is within 3 px, the confidence is 0.9999, and there are at most 5000 samples.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from planegrasp import _core
from planegrasp.bench.scenes import CAMERA
from planegrasp.homography import HomographyConfig

if TYPE_CHECKING:
    from planegrasp._core import Evidence
    from planegrasp.search import FaceSearch

Points = NDArray[np.float64]
Estimator = Callable[[Points, Points], "Points | None"]

_CONFIDENCE = 0.9999
_LIMITS = HomographyConfig()


def _opencv(source: Points, target: Points, *, method: int) -> Points | None:
    try:
        matrix, _ = cv2.findHomography(
            source,
            target,
            method,
            ransacReprojThreshold=_LIMITS.threshold,
            maxIters=_LIMITS.iterations,
            confidence=_CONFIDENCE,
        )
    except cv2.error:  # some variants fail so where they find nothing
        return None
    return None if matrix is None else np.asarray(matrix, dtype=np.float64)


def _poselib(source: Points, target: Points, *, progressive: bool) -> Points | None:
    import poselib

    options = {
        "max_reproj_error": _LIMITS.threshold,
        "max_iterations": _LIMITS.iterations,
        "min_iterations": 100,
        "success_prob": _CONFIDENCE,
        "progressive_sampling": progressive,
        "seed": 0,
    }
    bundle = {"loss_type": "CAUCHY", "loss_scale": _LIMITS.threshold / 3}
    matrix, result = poselib.estimate_homography(source, target, options, bundle)
    return np.asarray(matrix, dtype=np.float64) if result["num_inliers"] >= 4 else None


def _planegrasp(source: Points, target: Points) -> Points | None:
    found = _core.estimate_homography(
        source, target, threshold=_LIMITS.threshold, max_iterations=_LIMITS.iterations
    )
    return None if found is None else found[0]


def _kornia(source: Points, target: Points) -> Points | None:
    import kornia_rs

    try:
        matrix, _, _ = kornia_rs.k3d.ransac_homography(
            source,
            target,
            threshold=_LIMITS.threshold,
            max_iterations=_LIMITS.iterations,
            min_inliers=4,
            seed=0,
        )
    except ValueError:  # no homography has as many inliers
        return None
    return np.asarray(matrix, dtype=np.float64)


ESTIMATORS: dict[str, Estimator] = {
    "OpenCV RANSAC": partial(_opencv, method=cv2.RANSAC),
    "OpenCV LMEDS": partial(_opencv, method=cv2.LMEDS),
    "OpenCV RHO": partial(_opencv, method=cv2.RHO),
    "OpenCV USAC_DEFAULT": partial(_opencv, method=cv2.USAC_DEFAULT),
    "OpenCV USAC_FAST": partial(_opencv, method=cv2.USAC_FAST),
    "OpenCV USAC_ACCURATE": partial(_opencv, method=cv2.USAC_ACCURATE),
    "OpenCV USAC_MAGSAC": partial(_opencv, method=cv2.USAC_MAGSAC),
    "OpenCV USAC_PROSAC": partial(_opencv, method=cv2.USAC_PROSAC),
    "PoseLib uniform": partial(_poselib, progressive=False),
    "PoseLib progressive": partial(_poselib, progressive=True),
    "kornia-rs": _kornia,
    "planegrasp": _planegrasp,
}

# What the detector does is our own, refined; beside it the best of the others, refined.
REFINED = {
    "USAC_PROSAC + refine": ESTIMATORS["OpenCV USAC_PROSAC"],
    "PoseLib + refine": ESTIMATORS["PoseLib progressive"],
    "planegrasp + refine": ESTIMATORS["planegrasp"],
}
_PACKAGES = {"PoseLib": "poselib", "kornia-rs": "kornia_rs"}


def refined(
    estimator: Estimator, source: Points, target: Points, search: FaceSearch, evidence: Evidence
) -> Points | None:
    """An estimate for face 0, refined as the detector does over all matches that agree with it."""
    matrix = estimator(source, target)
    estimate = None if matrix is None else search.refine(matrix, evidence, 0, CAMERA)
    return None if estimate is None else estimate.matrix


def installed(name: str) -> bool:
    """Whether the library of an estimator is installed."""
    package = next((p for prefix, p in _PACKAGES.items() if name.startswith(prefix)), None)
    return package is None or find_spec(package) is not None
