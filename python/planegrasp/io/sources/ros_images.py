"""Images, depth and cameras of ROS messages (sensor_msgs of ROS 1 and ROS 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from planegrasp.errors import CameraError, SourceError
from planegrasp.geometry import PinholeCamera
from planegrasp.io.images import MILLIMETRES
from planegrasp.io.lens import brown_conrady
from planegrasp.rgbd import measured

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

_COLORS = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1}  # channels
_DEPTHS: dict[str, np.dtype[Any]] = {
    "16UC1": np.dtype(np.uint16),
    "mono16": np.dtype(np.uint16),
    "32FC1": np.dtype("f4"),
}
_COMPRESSED_DEPTH_HEADER = 12  # bytes before the PNG of image_transport's compressedDepth
_LARGEST_LENS_ERROR = 0.5  # of a lens model in OpenCV's five coefficients [px]


def color_of(message: Any) -> NDArray[np.uint8]:
    """H×W×3 RGB of an Image or CompressedImage message.

    Raises:
        SourceError: its encoding is none of a colour image, or its data is damaged.
    """
    if not hasattr(message, "encoding"):
        rgb = _decoded(message.data, cv2.IMREAD_COLOR_RGB, message.format)
        return np.asarray(rgb, dtype=np.uint8)
    channels = _COLORS.get(message.encoding)
    if channels is None:
        raise SourceError(
            f"its encoding {message.encoding!r} is none of a colour image "
            f"(known: {', '.join(_COLORS)})"
        )
    pixels = _pixels(message, np.dtype(np.uint8), channels)
    if channels == 1:
        return np.repeat(pixels, 3, axis=2)
    rgb = pixels[:, :, 2::-1] if message.encoding.startswith("bgr") else pixels[:, :, :3]
    return np.ascontiguousarray(rgb)


def depth_of(message: Any, depth_scale: float = MILLIMETRES) -> NDArray[np.float32]:
    """H×W metres, 0 = no measurement, of an Image or CompressedImage message.

    Args:
        message: of 16UC1 (units of depth_scale) or 32FC1 (metres).
        depth_scale: metres per unit of 16UC1.

    Raises:
        SourceError: its encoding is none of a depth image, or its data is damaged.
    """
    if not hasattr(message, "encoding"):
        return _compressed_depth(message, depth_scale)
    kind = _DEPTHS.get(message.encoding)
    if kind is None:
        raise SourceError(
            f"its encoding {message.encoding!r} is none of a depth image "
            f"(known: 16UC1 in millimetres, 32FC1 in metres)"
        )
    return _metres(_pixels(message, kind, 1)[:, :, 0], depth_scale)


def camera_of(message: Any, *, rectified: bool = False) -> tuple[PinholeCamera, str]:
    """The camera of a CameraInfo message.

    Args:
        message: of ROS 1 or 2.
        rectified: whether the images were undistorted already; then its P counts, not K and D.

    Returns:
        The camera, and what the user should know of its lens, or "".

    Raises:
        CameraError: it is not calibrated, or has a lens model that cannot be expressed.
    """
    K, P, D = (
        np.asarray(getattr(message, key.lower(), getattr(message, key, ())), dtype=np.float64)
        for key in "KPD"
    )
    size = (int(message.width), int(message.height))
    focal, centre = ((K[0], K[4]), (K[2], K[5]))
    if rectified and P[0] > 0:
        focal, centre, D = (P[0], P[5]), (P[2], P[6]), np.zeros(0)
    if not (focal[0] > 0 and focal[1] > 0):
        raise CameraError("its camera_info is not calibrated (fx = 0): give a camera file")
    distortion, note = _distortion(message.distortion_model, D, size, focal, centre)
    (fx, fy), (cx, cy) = focal, centre
    camera = PinholeCamera(*size, float(fx), float(fy), float(cx), float(cy), distortion)
    return camera, note


def _distortion(
    model: str,
    D: NDArray[np.float64],
    size: tuple[int, int],
    focal: tuple[float, float],
    centre: tuple[float, float],
) -> tuple[tuple[float, ...], str]:
    if not D.any():
        return (), ""
    if model in ("plumb_bob", "") or (model == "rational_polynomial" and not D[5:].any()):
        return tuple(D[:5].tolist()), ""
    K = np.array([[focal[0], 0, centre[0]], [0, focal[1], centre[1]], [0, 0, 1]])
    undistort: Callable[..., Any]
    if model == "rational_polynomial":
        undistort = cv2.undistortPoints
    elif model == "equidistant":
        undistort = cv2.fisheye.undistortPoints
    else:
        raise CameraError(f"its lens model {model!r} is not known: give a camera file")
    distortion, error = brown_conrady(
        size, centre, focal, lambda p: undistort(np.array([[p]]), K, D).ravel().tolist()
    )
    note = ""
    if error > _LARGEST_LENS_ERROR:
        note = f"the lens model {model} is met to {error:.2g} px only"
    return distortion, note


def _compressed_depth(message: Any, depth_scale: float) -> NDArray[np.float32]:
    data = bytes(message.data)
    if "compressedDepth" not in message.format:
        return _metres(_single_channel(message, data), depth_scale)
    if "rvl" in message.format:
        raise SourceError(f"its format {message.format!r} is not known (known: png)")
    units = _single_channel(message, data[_COMPRESSED_DEPTH_HEADER:])
    if not message.format.startswith("32FC1"):
        return _metres(units, depth_scale)
    # image_transport stores inverse depth a / z + b in 16 bits, with a and b in its header.
    a, b = np.frombuffer(data, "<f4", 2, offset=4)
    with np.errstate(divide="ignore", invalid="ignore"):
        return _metres(np.where(units > 0, a / (units - b), 0).astype(np.float32), 1.0)


def _single_channel(message: Any, data: bytes) -> NDArray[Any]:
    image = _decoded(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED, message.format)
    if image.ndim != 2 or image.dtype != np.uint16:
        raise SourceError(f"its format {message.format!r} holds no depth image of 16 bits")
    return image


def _metres(values: NDArray[Any], depth_scale: float) -> NDArray[np.float32]:
    if values.dtype == np.uint16:
        metres: NDArray[np.float32] = values.astype(np.float32)
        metres *= np.float32(depth_scale)
        return metres
    return np.asarray(measured(values), dtype=np.float32)


def _decoded(data: Any, flags: int, described: str) -> NDArray[Any]:
    try:
        image = cv2.imdecode(_bytes(data), flags)
    except cv2.error as error:
        raise SourceError(f"an image of format {described!r} cannot be decoded") from error
    if image is None:
        raise SourceError(f"an image of format {described!r} cannot be decoded")
    return np.asarray(image)


def _pixels(message: Any, kind: np.dtype[Any], channels: int) -> NDArray[Any]:
    """H×W×C of the message's bytes, whose rows may be padded."""
    height, width, step = int(message.height), int(message.width), int(message.step)
    row = width * channels * kind.itemsize
    data = _bytes(message.data)
    if height < 1 or width < 1 or step < row or data.size < height * step:
        raise SourceError(
            f"an image of {width}×{height} {message.encoding} with rows of {step} bytes has "
            f"{data.size} bytes of data"
        )
    rows = np.ascontiguousarray(data[: height * step].reshape(height, step)[:, :row])
    order = kind.newbyteorder(">" if message.is_bigendian else "<")
    pixels = rows.view(order).reshape(height, width, channels)
    return pixels.astype(kind, copy=False)


def _bytes(data: Any) -> NDArray[np.uint8]:
    """What libraries give as the bytes of a message: an array, or bytes."""
    if isinstance(data, (bytes, bytearray, memoryview)):
        return np.frombuffer(data, np.uint8)
    return np.asarray(data, dtype=np.uint8)
