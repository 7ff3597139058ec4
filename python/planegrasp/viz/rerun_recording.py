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

from typing import TYPE_CHECKING, Any

from planegrasp.results import ResultSink
from planegrasp.undistorted import Undistorted
from planegrasp.viz.geometry import face_size
from planegrasp.viz.palette import color_of
from planegrasp.viz.rerun_parts import (
    axes,
    begun,
    closed,
    encoded_color,
    encoded_depth,
    pinhole,
    point_cloud,
    pose_of,
    rerun,
    textured,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from planegrasp.detection import Detection
    from planegrasp.geometry import PinholeCamera
    from planegrasp.objects import ObjectModel, PlanarFace
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.viz.palette import RGB


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
        self._rr = rr = rerun()
        self._objects = {model.name: model for model in objects}
        self._colors = colors
        self._number = 0
        self._camera: PinholeCamera | None = None
        self._textured: set[tuple[str, ...]] = set()
        self._shown: set[tuple[str, ...]] = set()
        self._stream = begun(rr, path, _blueprint())
        self._log(["world"], rr.ViewCoordinates.RIGHT_HAND_Y_DOWN, static=True)

    def write(self, frame: RGBDFrame, detections: Sequence[Detection]) -> None:
        """Add one frame with its detections."""
        self._stream.set_time("frame", sequence=self._number)
        if frame.timestamp is not None:
            self._stream.set_time("time", duration=frame.timestamp)
        self._number += 1
        if frame.camera != self._camera:
            self._camera = frame.camera
            self._log(["world", "camera"], pinhole(self._rr, frame.camera))
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

    def _log_images(self, frame: RGBDFrame) -> None:
        color = self._undistorted.image(frame.color)
        self._log(["world", "camera", "color"], encoded_color(self._rr, color))
        cloud, depth = ["world", "cloud"], ["world", "camera", "depth"]
        if frame.depth is None or not frame.has_depth:
            self._log(cloud, self._rr.Clear(recursive=True))
            self._log(depth, self._rr.Clear(recursive=True))
            return
        metres = self._undistorted.depth(frame.depth)
        self._log(depth, encoded_depth(self._rr, metres))
        positions, colors, radius = point_cloud(metres, color, frame.camera)
        self._log(cloud, self._rr.Points3D(positions, colors=colors, radii=radius))

    def _log_detection(self, detection: Detection, camera: PinholeCamera) -> set[tuple[str, ...]]:
        """Log one detection; returns the entities to clear when it is gone."""
        color = color_of(detection.name, self._colors)
        which = (detection.name, str(detection.instance))
        outlines = ("world", "camera", "outlines", *which)
        strips = [closed(camera.undistort(face.corners)) for face in detection.faces]
        self._log(outlines, self._rr.LineStrips2D(strips, colors=[color], radii=1.5))
        if detection.pose is None:
            return {outlines}
        root = ("world", "objects", *which)
        self._log(root, pose_of(self._rr, detection.pose.T_camera_object))
        length = min(face_size(detection, camera)) / 2
        self._log((*root, "axes"), axes(self._rr, length))
        if detection.name in self._objects:
            for face in self._objects[detection.name].faces:
                self._log_face((*root, "faces", face.name), face, color)
        return {outlines, root}

    def _log_face(self, path: tuple[str, ...], face: PlanarFace, color: RGB) -> None:
        """The face with its picture; the picture is stored once, the corners in every frame."""
        corners = face.object_corners
        outline = self._rr.LineStrips3D([closed(corners)], colors=[color], radii=face.width / 100)
        self._log((*path, "outline"), outline)
        if path not in self._textured:
            self._textured.add(path)
            self._log(path, textured(self._rr, face.image), static=True)
        self._log(path, self._rr.Mesh3D.from_fields(vertex_positions=corners))


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
