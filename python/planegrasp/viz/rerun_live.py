"""What a live system sees, for Rerun: as a file, in a viewer or in a browser.

    world                          the fixed frame; the camera's (y down, z forward) where it stands
    world/camera                   the pinhole camera
    world/camera/color             the image, as JPEG
    world/camera/outlines/…        outline of each face seen, on the image
    world/cloud                    the depth image as coloured points
    world/objects/NAME/INSTANCE    filtered pose of an object that is seen
                  …/axes           x red, y green, z blue
                  …/faces/FACE     the taught faces with their reference images
                  …/body           the outer box of an object that has one
                  …/grasps/GRASP   a gripper where the taught grasp wants it
    world/velocities/NAME/INSTANCE way in the next half second of what moves
    plots/rate/…                   camera, tracking, detector [Hz]
    plots/latency/…                of tracking: median and 99 % of the last seconds [ms]
    plots/count/…                  objects seen, frames dropped
    states/NAME/INSTANCE           seen, hidden, skipped, lost
    events                         what happens, in words

Timelines are `frame` (number) and `time` (since the first frame). Images and clouds come at a
reduced rate. Rerun's camera has no lens distortion, so images are undistorted first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform
from planegrasp.undistorted import Undistorted
from planegrasp.viz.palette import color_of
from planegrasp.viz.picture_rate import PictureRate
from planegrasp.viz.rerun_live_objects import ObjectEntities
from planegrasp.viz.rerun_parts import closed, encoded_color, pinhole, point_cloud, pose_of, rerun

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planegrasp.geometry import PinholeCamera
    from planegrasp.live import LiveFrame, LiveRates
    from planegrasp.rgbd import RGBDFrame
    from planegrasp.viz.palette import RGB
    from planegrasp.viz.rerun_streams import RerunStream

__all__ = ["LiveRecording", "LiveRecordingConfig"]

_STATE_COLORS = {
    "seen": (60, 190, 90),
    "hidden": (240, 170, 40),
    "skipped": (120, 140, 240),
    "lost": (210, 70, 70),
}


@dataclass(frozen=True, slots=True)
class LiveRecordingConfig:
    """What a live recording holds.

    Attributes:
        image_rate: images and clouds a second of the frames' time, at most [Hz]; 0 for none.
        cloud: whether depth is shown as points.
        grasps: whether taught grasps are shown.
    """

    image_rate: float = 10.0
    cloud: bool = True
    grasps: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.image_rate <= 1000.0:
            raise InvalidInputError(
                f"the rate of images is from 0 to 1000 Hz, got {self.image_rate}"
            )


class LiveRecording(ClosesAtEnd):
    """Logs what is known after each frame; a context manager that closes its stream.

    Args:
        stream: where to, see `rerun_streams`.
        colors: colour (RGB) by object name, as `object_colors` gives.
        config: what it holds.
    """

    def __init__(
        self,
        stream: RerunStream,
        colors: Mapping[str, RGB] | None = None,
        config: LiveRecordingConfig | None = None,
    ) -> None:
        self.config = config or LiveRecordingConfig()
        self._rr = rr = rerun()
        self._target = stream
        self._colors = colors
        self._objects = ObjectEntities(self._log, colors, self.config)
        self._number = 0
        self._first: float | None = None
        self._pictures = PictureRate(self.config.image_rate)
        self._camera: PinholeCamera | None = None
        self._outlined: set[tuple[str, ...]] = set()
        self._states: dict[tuple[str, ...], str] = {}
        self._log(["world"], rr.ViewCoordinates.RIGHT_HAND_Y_DOWN, static=True)
        for path, name in _SERIES.items():
            self._log(["plots", *path], rr.SeriesLines(names=[name]), static=True)

    def write(
        self,
        seen: LiveFrame,
        rates: LiveRates | None = None,
        T_fixed_camera: RigidTransform | None = None,
    ) -> None:
        """Log one frame.

        Args:
            seen: what is known after it.
            rates: how fast it goes.
            T_fixed_camera: pose of the camera, where it moves.

        Raises:
            ViewerError: the viewer is gone.
            RecordingError: the file cannot be written any further.
        """
        frame = seen.frame
        self._begin(frame)
        T = RigidTransform.identity() if T_fixed_camera is None else T_fixed_camera
        self._log(["world", "camera"], pose_of(self._rr, T))
        if frame.camera != self._camera:
            self._camera, self._undistorted = frame.camera, Undistorted(frame.camera)
            self._log(["world", "camera"], pinhole(self._rr, frame.camera))
            self._pictures.restart()
        if self._pictures.is_due(frame.timestamp):
            self._log_images(frame, T)
        self._log_outlines(seen)
        self._objects.write(seen.tracks)
        self._log_states(seen)
        self._log_plots(seen, rates)
        self._number += 1
        self._target.check()

    def note(self, text: str, level: str = "INFO") -> None:
        """Log in words what happens, at the time of the last frame; level as in Rerun's TextLog."""
        self._log(["events"], self._rr.TextLog(text, level=level))

    def close(self) -> None:
        """Write what is still buffered, and close the stream; raises as `write` does."""
        self._target.close()

    def _log(self, path: list[str] | tuple[str, ...], what: Any, *, static: bool = False) -> None:
        self._target.stream.log(list(path), what, static=static, strict=True)

    def _begin(self, frame: RGBDFrame) -> None:
        stream = self._target.stream
        stream.set_time("frame", sequence=self._number)
        if frame.timestamp is not None:
            self._first = frame.timestamp if self._first is None else self._first
            stream.set_time("time", duration=frame.timestamp - self._first)

    def _log_images(self, frame: RGBDFrame, T_fixed_camera: RigidTransform) -> None:
        color = self._undistorted.image(frame.color)
        self._log(["world", "camera", "color"], encoded_color(self._rr, color))
        cloud = ["world", "cloud"]
        if not self.config.cloud:
            return
        if frame.depth is None or not frame.has_depth:
            self._log(cloud, self._rr.Clear(recursive=True))
            return
        metres = self._undistorted.depth(frame.depth)
        positions, colors, radius = point_cloud(metres, color, frame.camera)
        self._log(cloud, pose_of(self._rr, T_fixed_camera))
        self._log(cloud, self._rr.Points3D(positions, colors=colors, radii=radius))

    def _log_outlines(self, seen: LiveFrame) -> None:
        shown: set[tuple[str, ...]] = set()
        for found in seen.detections:
            path = ("world", "camera", "outlines", found.name, str(found.instance))
            strips = [closed(seen.frame.camera.undistort(face.corners)) for face in found.faces]
            color = color_of(found.name, self._colors)
            self._log(path, self._rr.LineStrips2D(strips, colors=[color], radii=1.5))
            shown.add(path)
        for gone in self._outlined - shown:
            self._log(gone, self._rr.Clear(recursive=True))
        self._outlined = shown

    def _log_states(self, seen: LiveFrame) -> None:
        skipped = {(one.name, one.instance) for one in seen.skipped}
        states: dict[tuple[str, ...], str] = {
            ("states", t.name, str(t.instance)): "lost" for t in seen.lost
        }
        for track in seen.tracks:
            state = "seen"
            if track.detection is None:
                state = "skipped" if (track.name, track.instance) in skipped else "hidden"
            states["states", track.name, str(track.instance)] = state
        for path, state in states.items():
            if path not in self._states:
                self._log(path, _state_look(self._rr), static=True)
            if self._states.get(path) != state:
                self._log(path, self._rr.StateChange(state=state))
        self._states |= states

    def _log_plots(self, seen: LiveFrame, rates: LiveRates | None) -> None:
        values: dict[tuple[str, str], float] = {("count", "seen"): len(seen.detections)}
        if rates is not None:
            values |= {
                ("rate", "camera"): rates.camera,
                ("rate", "tracking"): rates.tracking,
                ("rate", "detector"): rates.passes,
                ("latency", "p50"): 1000 * rates.latency_p50,
                ("latency", "p99"): 1000 * rates.latency_p99,
                ("count", "dropped"): rates.dropped,
            }
        for path, value in values.items():
            self._log(["plots", *path], self._rr.Scalars(value))


_SERIES = {
    ("rate", "camera"): "camera, Hz",
    ("rate", "tracking"): "tracking, Hz",
    ("rate", "detector"): "detector, Hz",
    ("latency", "p50"): "median, ms",
    ("latency", "p99"): "99 %, ms",
    ("count", "seen"): "objects seen",
    ("count", "dropped"): "frames dropped",
}


def _state_look(rr: Any) -> Any:
    return rr.StateConfiguration(values=list(_STATE_COLORS), colors=list(_STATE_COLORS.values()))
