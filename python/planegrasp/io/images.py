"""Reading and writing colour and depth images, with errors that name the file and the fault.

A file is decoded whole or not at all: every truncated file is a `SourceError`.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from planegrasp.errors import DepthError, InvalidInputError, SourceError
from planegrasp.io.atomic import write_atomically
from planegrasp.rgbd import check_color

if TYPE_CHECKING:
    from numpy.typing import NDArray

IMAGE_SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".webp", ".tif", ".tiff", ".ppm"})
"""Lower-case suffixes of the image files that a folder is searched for."""

MILLIMETRES = 0.001
"""Depth scale of most depth images: one unit is a millimetre."""

_SIGNATURES = {
    b"\x89PNG\r\n\x1a\n": "PNG",
    b"\xff\xd8\xff": "JPEG",
    b"BM": "BMP",
    b"II*\x00": "TIFF",
    b"MM\x00*": "TIFF",
    b"RIFF": "WebP",
}
_LARGEST_UNIT = np.iinfo(np.uint16).max


def read_color(path: str | Path) -> NDArray[np.uint8]:
    """Read a colour image as H×W×3 uint8 RGB, turned upright as its EXIF data says.

    Grey images get three equal channels, an alpha channel is dropped, 16 bits become 8.

    Raises:
        SourceError: the file is missing, empty, truncated, damaged or not an image.
    """
    path = Path(path)
    return np.asarray(_decode(path, _read_bytes(path), cv2.IMREAD_COLOR_RGB), dtype=np.uint8)


def read_depth(path: str | Path, depth_scale: float = MILLIMETRES) -> NDArray[np.float32]:
    """Read a depth image as H×W float32 metres, 0 = no measurement.

    Args:
        path: a 16-bit PNG or TIFF of one channel, or a `.npy` file of floating-point metres.
        depth_scale: metres per unit of a 16-bit image (0.001 for millimetres); not applied to
            a `.npy` file, which is in metres already.

    Raises:
        SourceError: the file is missing, empty, truncated, damaged, or not a depth image.
        InvalidInputError: depth_scale is not positive.
    """
    path = Path(path)
    if not (np.isfinite(depth_scale) and depth_scale > 0):
        raise InvalidInputError(f"depth_scale must be > 0 metres per unit, got {depth_scale}")
    data = _read_bytes(path)
    if path.suffix.lower() == ".npy":
        return _decode_array(path, data)
    image = _decode(path, data, cv2.IMREAD_UNCHANGED)
    if image.ndim != 2 or image.dtype != np.uint16:
        channels = 1 if image.ndim == 2 else image.shape[2]
        raise SourceError(
            f"{path} is not a depth image: a depth image has one channel of 16 bits, "
            f"this has {channels} of {8 * image.dtype.itemsize}"
        )
    return np.asarray(image * np.float32(depth_scale), dtype=np.float32)


def write_color(path: str | Path, image: NDArray[np.uint8]) -> None:
    """Write H×W×3 uint8 RGB atomically, in the format of the path's suffix.

    Raises:
        ImageError: the image is not H×W×3 uint8.
        InvalidInputError: the suffix names no image format.
        OSError: the file cannot be written.
    """
    bgr = np.ascontiguousarray(check_color(image)[:, :, ::-1])
    write_atomically(path, _encode(Path(path), bgr))


def write_depth(
    path: str | Path, depth: NDArray[np.float32], depth_scale: float = MILLIMETRES
) -> None:
    """Write H×W metres atomically: as a 16-bit PNG in units of depth_scale, or as `.npy` metres.

    Raises:
        DepthError: depth is not H×W, or does not fit 16 bits at this scale.
        InvalidInputError: depth_scale is not positive, or the suffix is neither .png nor .npy.
        OSError: the file cannot be written.
    """
    path = Path(path)
    metres = np.asarray(depth)
    if metres.ndim != 2:
        raise DepthError(f"a depth image is H×W, got shape {metres.shape}")
    if path.suffix.lower() == ".npy":
        stream = io.BytesIO()
        np.save(stream, metres.astype(np.float32))
        write_atomically(path, stream.getvalue())
        return
    if path.suffix.lower() != ".png":
        raise InvalidInputError(f"depth is written as .png (16 bits) or .npy, not {path.name!r}")
    if not (np.isfinite(depth_scale) and depth_scale > 0):
        raise InvalidInputError(f"depth_scale must be > 0 metres per unit, got {depth_scale}")
    valid = np.isfinite(metres) & (metres > 0)
    units = np.rint(np.where(valid, metres, 0.0) / depth_scale)
    if units.max(initial=0.0) > _LARGEST_UNIT:
        raise DepthError(
            f"{metres[valid].max():.6g} m does not fit 16 bits at {depth_scale} m per unit "
            f"(at most {_LARGEST_UNIT * depth_scale:.6g} m): is the depth in metres?"
        )
    write_atomically(path, _encode(path, units.astype(np.uint16)))


def _read_bytes(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise SourceError(f"there is no file {path}") from None
    except IsADirectoryError:
        raise SourceError(f"{path} is a folder, expected an image file") from None
    except OSError as error:
        raise SourceError(f"{path} cannot be read: {error.strerror}") from error
    if not data:
        raise SourceError(f"{path} is empty (0 bytes)")
    return data


def _decode(path: Path, data: bytes, flags: int) -> NDArray[np.uint8] | NDArray[np.uint16]:
    kind = next((name for start, name in _SIGNATURES.items() if data.startswith(start)), None)
    # Asked before decoding because libpng writes to stderr what it thinks of such files.
    if kind == "PNG" and b"IEND" not in data[-4096:]:
        raise SourceError(f"{path} is a truncated PNG file: its end is missing")
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error as error:
        raise SourceError(f"{path} cannot be decoded: {error}") from error
    if image is None:
        if kind is None:
            raise SourceError(f"{path} is not an image: it starts with {data[:8]!r}")
        raise SourceError(f"{path} is a truncated or damaged {kind} file")
    return image  # type: ignore[return-value]  # the stubs know no more than "an array"


def _decode_array(path: Path, data: bytes) -> NDArray[np.float32]:
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except (ValueError, EOFError, OSError) as error:
        raise SourceError(f"{path} is a truncated or damaged .npy file: {error}") from error
    if array.ndim != 2 or not np.issubdtype(array.dtype, np.floating):
        raise SourceError(
            f"{path} is not a depth image: a depth .npy holds H×W floating-point metres, "
            f"this holds {array.dtype} of shape {array.shape}"
        )
    return np.asarray(array, dtype=np.float32)


def _encode(path: Path, image: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    if path.suffix.lower() not in IMAGE_SUFFIXES:
        raise InvalidInputError(
            f"{path.name!r} names no image format: use one of {', '.join(sorted(IMAGE_SUFFIXES))}"
        )
    done, encoded = cv2.imencode(path.suffix.lower(), image)
    if not done:
        raise InvalidInputError(f"an image of shape {image.shape} cannot be stored as {path.name}")
    return encoded.tobytes()
