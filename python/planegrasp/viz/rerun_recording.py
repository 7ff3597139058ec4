"""Frames and detections as a Rerun recording (.rrd), written without a viewer or a display.

    world                          right-handed, the camera's optical frame: y down, z forward
    world/camera                   the pinhole camera
    world/camera/color             the image, as JPEG
    world/camera/depth             the depth image
    world/camera/outlines/…        outline of each found face, on the image
    world/cloud                    the depth image as coloured points
    world/objects/NAME/INSTANCE    pose of a found object
                  …/axes           x red, y green, z blue
                  …/faces/FACE     the taught faces with their reference images

Rerun's camera has no lens distortion, so images of a distorted camera are undistorted first.
Timelines are `frame` (number) and, where the source has timestamps, `time`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from planegrasp.errors import MissingExtraError
from planegrasp.results import ResultSink
from planegrasp.viz.geometry import face_size
from planegrasp.viz.palette import AXIS_COLORS, color_of
from planegrasp.viz.undistorted import Undistorted

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from planegrasp.detection import Detection
    from planegrasp.geometry import PinholeCamera
    from planegrasp.objects import ObjectModel, PlanarFace
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.viz.palette import RGB

_JPEG_QUALITY = 85
_MOST_POINTS = 20_000
_TEXTURE_SIDE = 384  # [px]
_DEPTH_UNITS = 5_000  # units a metre of the stored depth image: 16 bits reach 13 m


class RerunRecording(ResultSink):
    """Writes a Rerun recording.

    Raises:
        MissingExtraError: rerun-sdk is not installed.
        OSError: the file cannot be written.
    """

    def __init__(
        self,
        path: str | Path,
        objects: Iterable[ObjectModel] = (),
        colors: Mapping[str, RGB] | None = None,
    ) -> None:
        """Begin a recording.

        Args:
            path: of the .rrd file, which is replaced.
            objects: of the library, so that found objects are shown with their faces.
            colors: colour (RGB) by object name, as `object_colors` gives.
        """
        try:
            import rerun
        except ImportError as error:
            raise MissingExtraError("recording to Rerun", "rerun") from error
        self._rr: Any = rerun
        self._objects = {model.name: model for model in objects}
        self._colors = colors
        self._number = 0
        self._camera: PinholeCamera | None = None
        self._textured: set[tuple[str, ...]] = set()
        self._shown: set[tuple[str, ...]] = set()
        path = Path(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        self._stream = rerun.RecordingStream("planegrasp")
        try:
            self._stream.save(path, default_blueprint=_blueprint())
        except RuntimeError as error:
            raise OSError(f"the recording cannot be written: {error}") from error
        self._log(["world"], rerun.ViewCoordinates.RIGHT_HAND_Y_DOWN, static=True)

    def write(self, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Add one frame with its detections."""
        self._stream.set_time("frame", sequence=self._number)
        if frame.timestamp is not None:
            self._stream.set_time("time", duration=frame.timestamp)
        self._number += 1
        if frame.camera != self._camera:
            self._camera = frame.camera
            self._log_camera(frame.camera)
            self._undistorted = Undistorted(frame.camera)
        self._log_images(frame)
        shown: set[tuple[str, ...]] = set()
        for detection in detections:
            shown |= self._log_detection(detection, frame.camera)
        for gone in self._shown - shown:
            self._log(gone, self._rr.Clear(recursive=True))
        self._shown = shown

    def close(self) -> None:
        """Write what is still buffered and close the file."""
        self._stream.flush()
        self._stream.disconnect()

    def _log(self, path: Sequence[str], what: Any, *, static: bool = False) -> None:
        self._stream.log(list(path), what, static=static, strict=True)

    def _log_camera(self, camera: PinholeCamera) -> None:
        pinhole = self._rr.Pinhole(
            image_from_camera=camera.matrix,
            resolution=[camera.width, camera.height],
            camera_xyz=self._rr.ViewCoordinates.RDF,
            image_plane_distance=0.15,
        )
        self._log(["world", "camera"], pinhole)

    def _log_images(self, frame: RGBDFrame) -> None:
        color = self._undistorted.color(frame.color)
        self._log(
            ["world", "camera", "color"],
            self._rr.EncodedImage(contents=_jpeg(color), media_type="image/jpeg"),
        )
        cloud, depth = ["world", "cloud"], ["world", "camera", "depth"]
        if frame.depth is None or not frame.has_depth:
            self._log(cloud, self._rr.Clear(recursive=True))
            self._log(depth, self._rr.Clear(recursive=True))
            return
        metres = self._undistorted.depth(frame.depth)
        units = np.rint(metres * _DEPTH_UNITS)
        units[units > np.iinfo(np.uint16).max] = 0
        png = cv2.imencode(".png", units.astype(np.uint16))[1].tobytes()
        self._log(
            depth,
            self._rr.EncodedDepthImage(png, media_type="image/png", meter=float(_DEPTH_UNITS)),
        )
        positions, colors, radius = point_cloud(metres, color, frame.camera)
        self._log(cloud, self._rr.Points3D(positions, colors=colors, radii=radius))

    def _log_detection(self, detection: Detection, camera: PinholeCamera) -> set[tuple[str, ...]]:
        """Log one detection; returns the entities to clear when it is gone."""
        color = color_of(detection.name, self._colors)
        which = (detection.name, str(detection.instance))
        outlines = ("world", "camera", "outlines", *which)
        strips = [_closed(camera.undistort(face.corners)) for face in detection.faces]
        self._log(outlines, self._rr.LineStrips2D(strips, colors=[color], radii=1.5))
        if detection.pose is None:
            return {outlines}
        root = ("world", "objects", *which)
        T = detection.pose.T_camera_object
        pose = self._rr.Transform3D(
            translation=T.translation, quaternion=self._rr.Quaternion(xyzw=T.rotation.as_quat())
        )
        self._log(root, pose)
        length = min(face_size(detection, camera)) / 2
        axes = self._rr.Arrows3D(
            vectors=length * np.eye(3), colors=AXIS_COLORS, radii=length / 18, show_labels=False
        )
        self._log((*root, "axes"), axes)
        if detection.name in self._objects:
            for face in self._objects[detection.name].faces:
                self._log_face((*root, "faces", face.name), face, color)
        return {outlines, root}

    def _log_face(self, path: tuple[str, ...], face: PlanarFace, color: RGB) -> None:
        """The face with its picture; the picture is stored once, the corners in every frame."""
        corners = face.object_corners
        outline = self._rr.LineStrips3D([_closed(corners)], colors=[color], radii=face.width / 100)
        self._log((*path, "outline"), outline)
        if path not in self._textured:
            self._textured.add(path)
            picture = _shrunk(face.image, _TEXTURE_SIDE)
            rows, columns = picture.shape[:2]
            format_ = self._rr.components.ImageFormat(
                columns,
                rows,
                color_model=self._rr.ColorModel.RGB,
                channel_datatype=self._rr.ChannelDatatype.U8,
            )
            look = self._rr.Mesh3D.from_fields(
                triangle_indices=[[0, 3, 2], [0, 2, 1]],
                vertex_texcoords=[[0, 0], [1, 0], [1, 1], [0, 1]],
                albedo_texture_buffer=picture.tobytes(),
                albedo_texture_format=format_,
            )
            self._log(path, look, static=True)
        self._log(path, self._rr.Mesh3D.from_fields(vertex_positions=corners))


def point_cloud(
    depth: NDArray[np.float32], color: NDArray[np.uint8], camera: PinholeCamera
) -> tuple[NDArray[np.float32], NDArray[np.uint8], float]:
    """A depth image without lens distortion as coloured points, thinned to at most about 20 000.

    Args:
        depth: H×W metres, 0 = no measurement.
        color: H×W×3 RGB.
        camera: whose K is used, without its distortion.

    Returns:
        N×3 points [m] in the camera's optical frame, N×3 colours (RGB), and a radius [m] at which
        neighbours touch.
    """
    rows, columns = depth.shape
    step = max(1, int(np.ceil(np.sqrt(rows * columns / _MOST_POINTS))))
    v, u = np.mgrid[0:rows:step, 0:columns:step]
    z = depth[v, u]
    valid = z > 0
    u, v, z = u[valid], v[valid], z[valid]
    x = (u - camera.cx) / camera.fx * z
    y = (v - camera.cy) / camera.fy * z
    radius = 0.6 * step * float(np.median(z)) / camera.fx if len(z) else 0.0
    return np.column_stack([x, y, z]).astype(np.float32), color[v, u], radius


def _blueprint() -> Any:
    """The scene on the left, the image with what was found and the depth image on the right."""
    import rerun.blueprint as rrb

    scene = rrb.Spatial3DView(
        origin="world",
        contents=["$origin/**", "- $origin/camera/depth/**", "- $origin/camera/outlines/**"],
        name="Scene",
        eye_controls=rrb.EyeControls3D(
            position=(0.3, -0.25, -0.2), look_target=(0.0, 0.05, 0.55), eye_up=(0.0, -1.0, 0.0)
        ),
    )
    image = rrb.Spatial2DView(
        origin="world/camera",
        contents=["$origin/**", "- $origin/depth/**", "/world/objects/**"],
        name="Image",
    )
    depth = rrb.Spatial2DView(
        origin="world/camera", contents=["$origin/depth", "$origin/outlines/**"], name="Depth"
    )
    return rrb.Blueprint(
        rrb.Horizontal(scene, rrb.Vertical(image, depth), column_shares=[3, 2]),
        rrb.TimePanel(timeline="frame"),
        collapse_panels=True,
    )


def _jpeg(color: NDArray[np.uint8]) -> bytes:
    bgr = np.ascontiguousarray(color[:, :, ::-1])
    return cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1].tobytes()


def _closed(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.vstack([corners, corners[:1]])


def _shrunk(image: NDArray[np.uint8], side: int) -> NDArray[np.uint8]:
    rows, columns = image.shape[:2]
    scale = side / max(rows, columns)
    if scale >= 1:
        return image
    size = (max(1, round(columns * scale)), max(1, round(rows * scale)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
