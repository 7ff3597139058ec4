"""What recordings for Rerun have in common: the file, images, clouds, poses, printed faces."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from planegrasp.errors import MissingExtraError
from planegrasp.viz.palette import AXIS_COLORS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera, RigidTransform

_JPEG_QUALITY = 85
_MOST_POINTS = 20_000
_TEXTURE_SIDE = 384  # [px]
_DEPTH_UNITS = 5_000  # units a metre of the stored depth image: 16 bits reach 13 m


def rerun() -> Any:
    """The module of rerun-sdk.

    Raises:
        MissingExtraError: it is not installed.
    """
    try:
        import rerun
    except ImportError as error:
        raise MissingExtraError("recording to Rerun", "rerun") from error
    return rerun


def begun(rr: Any, path: str | Path, blueprint: Any) -> Any:
    """A stream into a new file, whose folder is made.

    Raises:
        OSError: the file cannot be written.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    stream = rr.RecordingStream("planegrasp")
    try:
        stream.save(path, default_blueprint=blueprint)
    except RuntimeError as error:
        raise OSError(f"the recording cannot be written: {error}") from error
    return stream


def pose_of(rr: Any, T: RigidTransform) -> Any:
    """A pose in its parent entity."""
    return rr.Transform3D(
        translation=T.translation, quaternion=rr.Quaternion(xyzw=T.rotation.as_quat())
    )


def axes(rr: Any, length: float) -> Any:
    """X red, y green, z blue, of a length [m]."""
    return rr.Arrows3D(
        vectors=length * np.eye(3), colors=AXIS_COLORS, radii=length / 18, show_labels=False
    )


def pinhole(rr: Any, camera: PinholeCamera) -> Any:
    """A camera without its distortion."""
    return rr.Pinhole(
        image_from_camera=camera.matrix,
        resolution=[camera.width, camera.height],
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=0.15,
    )


def encoded_color(rr: Any, color: NDArray[np.uint8]) -> Any:
    """H×W×3 RGB as JPEG."""
    return rr.EncodedImage(contents=_jpeg(color), media_type="image/jpeg")


def encoded_depth(rr: Any, metres: NDArray[np.float32]) -> Any:
    """H×W metres as PNG of 16 bits."""
    units = np.rint(metres * _DEPTH_UNITS)
    units[units > np.iinfo(np.uint16).max] = 0
    png = cv2.imencode(".png", units.astype(np.uint16))[1].tobytes()
    return rr.EncodedDepthImage(png, media_type="image/png", meter=float(_DEPTH_UNITS))


def textured(rr: Any, image: NDArray[np.uint8]) -> Any:
    """A mesh of two triangles with a picture, whose corners are logged apart from it."""
    picture = _shrunk(image, _TEXTURE_SIDE)
    rows, columns = picture.shape[:2]
    format_ = rr.components.ImageFormat(
        columns,
        rows,
        color_model=rr.ColorModel.RGB,
        channel_datatype=rr.ChannelDatatype.U8,
    )
    return rr.Mesh3D.from_fields(
        triangle_indices=[[0, 3, 2], [0, 2, 1]],
        vertex_texcoords=[[0, 0], [1, 0], [1, 1], [0, 1]],
        albedo_texture_buffer=picture.tobytes(),
        albedo_texture_format=format_,
    )


def point_cloud(
    depth: NDArray[np.float32],
    color: NDArray[np.uint8],
    camera: PinholeCamera,
    most: int = _MOST_POINTS,
) -> tuple[NDArray[np.float32], NDArray[np.uint8], float]:
    """A depth image without lens distortion as coloured points, thinned by rows and columns.

    Args:
        depth: H×W metres, 0 = no measurement.
        color: H×W×3 RGB.
        camera: whose K is used, without its distortion.
        most: so many pixels are looked at, at most.

    Returns:
        N×3 points [m] in the camera's optical frame, N×3 colours (RGB), and a radius [m] at which
        neighbours touch.
    """
    rows, columns = depth.shape
    step = max(1, int(np.ceil(np.sqrt(rows * columns / most))))
    v, u = np.mgrid[0:rows:step, 0:columns:step]
    z = depth[v, u]
    valid = z > 0
    u, v, z = u[valid], v[valid], z[valid]
    x = (u - camera.cx) / camera.fx * z
    y = (v - camera.cy) / camera.fy * z
    radius = 0.6 * step * float(np.median(z)) / camera.fx if len(z) else 0.0
    return np.column_stack([x, y, z]).astype(np.float32), color[v, u], radius


def _jpeg(color: NDArray[np.uint8]) -> bytes:
    bgr = np.ascontiguousarray(color[:, :, ::-1])
    return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1].tobytes()


def closed(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """The corners with the first one again."""
    return np.vstack([corners, corners[:1]])


def _shrunk(image: NDArray[np.uint8], side: int) -> NDArray[np.uint8]:
    rows, columns = image.shape[:2]
    scale = side / max(rows, columns)
    if scale >= 1:
        return image
    size = (max(1, round(columns * scale)), max(1, round(rows * scale)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
