"""What is followed, as markers for RViz."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.io.messages.pose import Pose
from planegrasp.io.ros2.conversions import box_pose, header_message, pose_message, xyz
from planegrasp.viz.palette import AXIS_COLORS, color_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planegrasp.io.messages.objects import TrackedObject, TracksMessage
    from planegrasp.io.ros2.transport import MessageTypes
    from planegrasp.viz.palette import RGB

__all__ = ["marker_array"]

# Of visualization_msgs/Marker.
_CUBE, _LINES, _TEXT = 1, 5, 9
_ADD, _DELETE = 0, 2
_BOXES, _AXES, _NAMES = "boxes", "axes", "names"
_SHOWN_FOR = 1  # so long without news [s], for example after a kill
_LINE_WIDTH, _TEXT_HEIGHT = 0.004, 0.03  # [m]


def marker_array(
    types: MessageTypes,
    message: TracksMessage,
    colors: Mapping[str, RGB] | None = None,
) -> Any:
    """visualization_msgs/MarkerArray: a box, axes and the name of each object that is seen.

    Objects that are lost or not seen are deleted. The marker's id is the track's number, its
    namespace says which part it is.

    Args:
        types: of messages.
        message: after a frame.
        colors: by object name, see `draw_detections`.
    """
    markers = []
    for tracked in message.objects:
        if tracked.seen:
            markers += _shown(_Maker(types, message, tracked.number), tracked, colors)
        else:
            markers += _deleted(_Maker(types, message, tracked.number))
    for number in message.lost:
        markers += _deleted(_Maker(types, message, number))
    return types("visualization_msgs/msg/MarkerArray")(markers=markers)


class _Maker:
    """Makes the markers of one track; members that are not given are empty."""

    def __init__(self, types: MessageTypes, message: TracksMessage, number: int) -> None:
        self.types = types
        self._message = message
        self._number = number

    def marker(self, part: str, kind: int, action: int = _ADD, **given: Any) -> Any:
        """A marker with these members."""
        types = self.types
        header = header_message(types, self._message.header)
        members = {
            "pose": pose_message(types, Pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))),
            "scale": xyz(types, "Vector3", (0.0, 0.0, 0.0)),
            "color": self.color((0, 0, 0), 0.0),
            "points": [],
            "colors": [],
            "text": "",
            **given,
        }
        nothing = np.zeros(0, np.uint8)
        return types("visualization_msgs/msg/Marker")(
            header=header,
            ns=part,
            id=self._number,
            type=kind,
            action=action,
            lifetime=types("builtin_interfaces/msg/Duration")(sec=_SHOWN_FOR, nanosec=0),
            frame_locked=False,
            texture_resource="",
            texture=types("sensor_msgs/msg/CompressedImage")(
                header=header, format="", data=nothing
            ),
            uv_coordinates=[],
            mesh_resource="",
            mesh_file=types("visualization_msgs/msg/MeshFile")(filename="", data=nothing),
            mesh_use_embedded_materials=False,
            **members,
        )

    def color(self, rgb: RGB, alpha: float) -> Any:
        """std_msgs/ColorRGBA."""
        # As float32, which the message holds, so that what is read equals what was written.
        r, g, b, a = np.array([*(value / 255 for value in rgb), alpha], np.float32).tolist()
        return self.types("std_msgs/msg/ColorRGBA")(r=r, g=g, b=b, a=a)


def _shown(maker: _Maker, tracked: TrackedObject, colors: Mapping[str, RGB] | None) -> list[Any]:
    types, pose = maker.types, tracked.pose.pose
    rgb = color_of(tracked.name, colors)
    length = sorted(tracked.box.size)[1] / 2
    tips = (length * np.eye(3)).tolist()
    ends = [point for tip in tips for point in ((0.0, 0.0, 0.0), tip)]
    box = maker.marker(
        _BOXES,
        _CUBE,
        pose=pose_message(types, box_pose(pose, tracked)),
        scale=xyz(types, "Vector3", tracked.box.size),
        color=maker.color(rgb, 0.5),
    )
    axes = maker.marker(
        _AXES,
        _LINES,
        pose=pose_message(types, pose),
        scale=xyz(types, "Vector3", (_LINE_WIDTH, 0.0, 0.0)),
        color=maker.color((0, 0, 0), 1.0),
        points=[xyz(types, "Point", end) for end in ends],
        colors=[maker.color(color, 1.0) for color in AXIS_COLORS for _ in range(2)],
    )
    above = pose.apply((0.0, tracked.box.size[1] / 2 + _TEXT_HEIGHT, 0.0))
    name = maker.marker(
        _NAMES,
        _TEXT,
        pose=pose_message(types, Pose(above, (0.0, 0.0, 0.0, 1.0))),
        scale=xyz(types, "Vector3", (0.0, 0.0, _TEXT_HEIGHT)),
        color=maker.color(rgb, 1.0),
        text=tracked.name + (f" #{tracked.instance}" if tracked.instance else ""),
    )
    return [box, axes, name]


def _deleted(maker: _Maker) -> list[Any]:
    parts = ((_BOXES, _CUBE), (_AXES, _LINES), (_NAMES, _TEXT))
    return [maker.marker(part, kind, _DELETE) for part, kind in parts]
