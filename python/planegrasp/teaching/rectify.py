"""From four corners in a photo to the face seen straight on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.checks import check_length
from planegrasp.errors import CameraError, InvalidInputError, TeachingError
from planegrasp.geometry import edge_from_pixel
from planegrasp.rgbd import check_color

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from planegrasp.geometry import PinholeCamera

__all__ = ["RectifiedFace", "check_corners", "estimate_aspect", "opposite_sides", "rectify"]

# Fewer pixels than this along a side hold too little to find again.
_SHORTEST_SIDE = 24.0
# How far outside of the photo a corner may be: a click beside the last pixel.
_OUTSIDE = 2.0
# Interior angles; only a rectangle seen along its surface looks sharper than this.
_SMALLEST_ANGLE = np.radians(5.0)
_LONGEST_RECTIFIED_SIDE = 2000
_MOST_SAMPLES_A_SIDE = 6

_CORNER_NAMES = ("top-left", "top-right", "bottom-right", "bottom-left")


@dataclass(frozen=True, slots=True, eq=False)
class RectifiedFace:
    """A face cut out of a photo.

    Attributes:
        image: H×W×3 uint8 RGB, the face straight on.
        width: of the face [m].
        height: of the face [m], as given or as estimated.
        photo_from_edge: 3×3, from edge coordinates of `image` to undistorted pixels of the photo.
    """

    image: NDArray[np.uint8]
    width: float
    height: float
    photo_from_edge: NDArray[np.float64]


def rectify(
    photo: NDArray[np.uint8],
    corners: ArrayLike,
    width: float,
    height: float | None = None,
    camera: PinholeCamera | None = None,
) -> RectifiedFace:
    """Cut a flat rectangle out of a photo and straighten it, without aliasing.

    The result is as large as the longest of the opposite sides in the photo, at most 2000 pixels,
    with square pixels on the face.

    Args:
        photo: H×W×3 uint8 RGB.
        corners: 4×2 pixels (centres at integers): top-left, top-right, bottom-right, bottom-left.
        width: of the face [m].
        height: of the face [m]; None estimates it with `estimate_aspect`.
        camera: that took the photo, to remove its lens distortion.

    Raises:
        TeachingError: the corners cannot be those of a rectangle in this photo.
        InvalidInputError: corners is not 4×2, or width or height is not positive.
        CameraError: the camera is for images of another size.
    """
    photo = check_color(photo)
    _check_camera(photo, camera)
    observed = check_corners(corners, photo.shape[:2])
    straight = camera.undistort(observed) if camera else observed
    width = check_length(width, "width")
    if height is None:
        height = width * estimate_aspect(observed, camera)
    height = check_length(height, "height")
    columns, rows = _rectified_size(straight, height / width)
    edge_corners = np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], np.float64)
    photo_from_edge = _homography(edge_corners, straight)
    image = _resample(photo, photo_from_edge, columns, rows, camera)
    return RectifiedFace(image, width, height, photo_from_edge)


def check_corners(corners: ArrayLike, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Return the corners as a 4×2 array if they can be those of a face in an image (rows, columns).

    Raises:
        InvalidInputError: they are not 4×2 finite numbers.
        TeachingError: they lie outside of the image, or are not a convex quadrilateral, clockwise
            from the top-left corner, with sides that are long enough.
    """
    points = np.asarray(corners, dtype=np.float64)
    if points.shape != (4, 2) or not np.all(np.isfinite(points)):
        raise InvalidInputError(
            f"corners are 4×2 finite pixels ({', '.join(_CORNER_NAMES)}), got {points.tolist()}"
        )
    rows, columns = shape
    last = np.array([columns - 1, rows - 1])
    outside = np.any((points < -_OUTSIDE) | (points > last + _OUTSIDE), axis=1)
    if outside.any():
        which = int(np.argmax(outside))
        raise TeachingError(
            f"the {_CORNER_NAMES[which]} corner {_show(points[which])} lies outside of the "
            f"{columns}×{rows} image: the whole face must be visible"
        )
    sides = np.roll(points, -1, axis=0) - points
    lengths = np.linalg.norm(sides, axis=1)
    if lengths.min() < _SHORTEST_SIDE:
        raise TeachingError(
            f"the shortest side between the corners is {lengths.min():.1f} pixels long; at least "
            f"{_SHORTEST_SIDE:.0f} are needed: move closer or use a larger photo"
        )
    following = np.roll(sides, -1, axis=0)
    # Sine of the turn at each corner: positive is clockwise on the screen, as x right and y down.
    turns = (sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]) / (
        lengths * np.roll(lengths, -1)
    )
    if np.all(turns < -np.sin(_SMALLEST_ANGLE)):
        raise TeachingError(
            f"the corners {_show(points)} run counter-clockwise, which would mirror the face: give "
            f"them clockwise, {', '.join(_CORNER_NAMES)} as printed on the object"
        )
    if not np.all(turns > np.sin(_SMALLEST_ANGLE)):
        raise TeachingError(
            f"the corners {_show(points)} are not a convex quadrilateral: give them in the order "
            f"{', '.join(_CORNER_NAMES)} as printed on the object"
        )
    return points


def estimate_aspect(corners: ArrayLike, camera: PinholeCamera | None = None) -> float:
    """Height over width of a rectangle whose four corners are seen in a photo.

    With the camera, the homography from the unit square, K⁻¹·H = [h₁ h₂ h₃], has h₁ and h₂ along
    the rectangle's sides with lengths in proportion to width and height, whatever the viewing
    angle. Without it, the ratio of the mean opposite sides is returned, which foreshortening
    falsifies.

    Args:
        corners: 4×2 observed pixels: top-left, top-right, bottom-right, bottom-left.
        camera: that took the photo.
    """
    points = np.asarray(corners, dtype=np.float64)
    if camera is None:
        width, height = opposite_sides(points).mean(axis=1)
        return float(height / width)
    rays = camera.rays(points)[:, :2]
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float64)
    h = _homography(square, rays)
    return float(np.linalg.norm(h[:, 1]) / np.linalg.norm(h[:, 0]))


def _homography(source: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """The 3×3 homography of exactly four correspondences, in double precision."""
    rows = []
    for (x, y), (u, v) in zip(source, target, strict=True):
        rows.append([x, y, 1, 0, 0, 0, -u * x, -u * y])
        rows.append([0, 0, 0, x, y, 1, -v * x, -v * y])
    h = np.linalg.solve(np.array(rows, np.float64), target.ravel())
    return np.append(h, 1.0).reshape(3, 3)


def opposite_sides(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lengths [[top, bottom], [right, left]] of the sides between four corners (4×2 or 4×3)."""
    top, right, bottom, left = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    return np.array([[top, bottom], [right, left]])


def _rectified_size(points: NDArray[np.float64], aspect: float) -> tuple[int, int]:
    """Columns and rows that lose no detail of the photo, with square pixels on the face."""
    across, down = opposite_sides(points).max(axis=1)
    columns = max(across, down / aspect)
    columns *= min(1.0, _LONGEST_RECTIFIED_SIDE / max(columns, columns * aspect))
    return max(1, round(columns)), max(1, round(columns * aspect))


def _resample(
    photo: NDArray[np.uint8],
    photo_from_edge: NDArray[np.float64],
    columns: int,
    rows: int,
    camera: PinholeCamera | None,
) -> NDArray[np.uint8]:
    """Render the face; where the photo is finer than the result, several samples are averaged."""
    samples = _samples_a_side(photo_from_edge, columns, rows)
    x, y = np.meshgrid(
        edge_from_pixel(np.arange(columns * samples)) / samples,
        edge_from_pixel(np.arange(rows * samples)) / samples,
    )
    positions = cv2.perspectiveTransform(
        np.stack([x, y], axis=-1).reshape(-1, 1, 2), photo_from_edge
    ).reshape(-1, 2)
    if camera:
        positions = camera.distort(positions)
    maps = positions.reshape(rows * samples, columns * samples, 2).astype(np.float32)
    fine = cv2.remap(
        photo, maps[..., 0], maps[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    if samples == 1:
        return np.asarray(fine, dtype=np.uint8)
    return np.asarray(cv2.resize(fine, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)


def _samples_a_side(photo_from_edge: NDArray[np.float64], columns: int, rows: int) -> int:
    """How many photo pixels a result pixel spans at most, along either of its sides."""
    x, y = np.meshgrid(np.linspace(0, columns, 5), np.linspace(0, rows, 5))
    centres = np.stack([x, y], axis=-1).reshape(-1, 1, 2)
    here = cv2.perspectiveTransform(centres, photo_from_edge)
    spans = [
        np.linalg.norm(cv2.perspectiveTransform(centres + step, photo_from_edge) - here, axis=-1)
        for step in ((1.0, 0.0), (0.0, 1.0))
    ]
    # Up to 1.3 photo pixels a sample there is nothing to see of aliasing.
    return int(np.clip(np.ceil(np.max(spans) / 1.3), 1, _MOST_SAMPLES_A_SIDE))


def _check_camera(photo: NDArray[np.uint8], camera: PinholeCamera | None) -> None:
    rows, columns = photo.shape[:2]
    if camera and (camera.width, camera.height) != (columns, rows):
        raise CameraError(
            f"the camera is for {camera.width}×{camera.height} images, this photo is "
            f"{columns}×{rows}"
        )


def _show(points: NDArray[np.float64]) -> str:
    pairs = [f"({x:.4g}, {y:.4g})" for x, y in points.reshape(-1, 2)]
    return " ".join(pairs)
