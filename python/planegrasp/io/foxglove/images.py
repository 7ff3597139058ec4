"""Images, calibrations and clouds as Foxglove's messages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from foxglove.messages import (
    CameraCalibration,
    CompressedImage,
    PackedElementField,
    PackedElementFieldNumericType,
    PointCloud,
    RawImage,
)

from planegrasp.io.foxglove.config import ColorFormat
from planegrasp.io.foxglove.values import IDENTITY, pose_message, timestamp
from planegrasp.io.images import MILLIMETRES
from planegrasp.viz.rerun_parts import point_cloud

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.io.messages.header import Header

__all__ = ["calibration", "cloud", "color_image", "depth_image"]

_POINT = np.dtype([("xyz", "<f4", 3), ("rgba", "u1", 4)])


def color_image(
    header: Header, color: NDArray[np.uint8], kind: ColorFormat, jpeg_quality: int = 90
) -> RawImage | CompressedImage:
    """An H×W×3 RGB image: RawImage (rgb8) or CompressedImage (png, jpeg)."""
    if kind is ColorFormat.RAW:
        return _raw(header, color, "rgb8")
    settings = [cv2.IMWRITE_JPEG_QUALITY, jpeg_quality] if kind is ColorFormat.JPEG else []
    bgr = np.ascontiguousarray(color[:, :, ::-1])
    data = cv2.imencode(f".{kind}", bgr, settings)[1].tobytes()
    return CompressedImage(
        timestamp=timestamp(header.stamp), frame_id=header.frame_id, data=data, format=str(kind)
    )


def depth_image(header: Header, depth: NDArray[np.float32]) -> RawImage:
    """H×W metres, 0 = no measurement, so that exactly the same is read back.

    16UC1 in millimetres where that gives the very same floats, else 32FC1 in metres.
    """
    units = np.rint(depth * 1000.0)
    if units.max(initial=0.0) <= np.iinfo(np.uint16).max:
        whole = units.astype(np.uint16)
        if np.array_equal(whole * np.float32(MILLIMETRES), depth):
            return _raw(header, whole, "16UC1")
    return _raw(header, depth, "32FC1")


def calibration(header: Header, camera: PinholeCamera) -> CameraCalibration:
    """The camera of an image that is not rectified."""
    P = np.zeros((3, 4))
    P[:, :3] = camera.matrix
    return CameraCalibration(
        timestamp=timestamp(header.stamp),
        frame_id=header.frame_id,
        width=camera.width,
        height=camera.height,
        distortion_model="plumb_bob",
        D=camera.coefficients.tolist(),
        K=camera.matrix.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=P.ravel().tolist(),
    )


def cloud(
    header: Header,
    depth: NDArray[np.float32],
    color: NDArray[np.uint8],
    camera: PinholeCamera,
    most: int,
) -> PointCloud:
    """A depth image without lens distortion as coloured points in the camera's optical frame.

    Args:
        header: of the image.
        depth: H×W metres, 0 = no measurement.
        color: H×W×3 RGB, without lens distortion.
        camera: whose K is used.
        most: so many points at most, about.
    """
    positions, colors, _ = point_cloud(depth, color, camera, most)
    points = np.empty(len(positions), _POINT)
    points["xyz"] = positions
    points["rgba"][:, :3] = colors
    points["rgba"][:, 3] = 255
    float32, uint8 = PackedElementFieldNumericType.Float32, PackedElementFieldNumericType.Uint8
    fields = [*((name, 4 * i, float32) for i, name in enumerate("xyz"))]
    fields += [(name, 12 + i, uint8) for i, name in enumerate(("red", "green", "blue", "alpha"))]
    return PointCloud(
        timestamp=timestamp(header.stamp),
        frame_id=header.frame_id,
        pose=pose_message(IDENTITY),
        point_stride=_POINT.itemsize,
        fields=[PackedElementField(name=n, offset=o, type=t) for n, o, t in fields],
        data=points.tobytes(),
    )


def _raw(
    header: Header, pixels: NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32], kind: str
) -> RawImage:
    height, width = pixels.shape[:2]
    little = np.ascontiguousarray(pixels, dtype=pixels.dtype.newbyteorder("<"))
    return RawImage(
        timestamp=timestamp(header.stamp),
        frame_id=header.frame_id,
        width=width,
        height=height,
        encoding=kind,
        step=little.strides[0],
        data=little.tobytes(),
    )
