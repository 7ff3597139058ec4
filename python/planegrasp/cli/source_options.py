"""Options of the commands that read frames from cameras and recordings."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from planegrasp.errors import InvalidInputError

if TYPE_CHECKING:
    from planegrasp.io.cameras import Camera
    from planegrasp.io.ros2 import Transport
    from planegrasp.io.sources import FrameSource, RecordingTopics

SourceArgument = Annotated[
    str,
    typer.Argument(
        help="A camera (realsense, realsense:SERIAL, openni, opencv:0, opencv:URL, ros2:/TOPIC), "
        "or anything that `detect` reads.",
        show_default=False,
    ),
]
OutputArgument = Annotated[
    Path,
    typer.Argument(
        help="NAME.mcap for an MCAP file with ROS 2 messages; else a new folder for color/, "
        "depth/ and camera.json.",
        show_default=False,
    ),
]
CameraOption = Annotated[
    Path | None, typer.Option(help="Camera file (JSON).", show_default="of the source")
]
FieldOfViewOption = Annotated[
    float | None,
    typer.Option(
        help="Horizontal field of view in degrees, where there is no camera file.",
        show_default="60",
    ),
]
DepthScaleOption = Annotated[
    float | None,
    typer.Option(help="Metres per unit of the depth images.", show_default="of the source"),
]
WidthOption = Annotated[
    int | None, typer.Option(min=1, help="Of a camera's images.", show_default="of the camera")
]
HeightOption = Annotated[
    int | None, typer.Option(min=1, help="Of a camera's images.", show_default="of the camera")
]
RateOption = Annotated[
    int | None, typer.Option(min=1, help="Of a camera, in Hz.", show_default="of the camera")
]
ColorTopicOption = Annotated[
    str | None, typer.Option(help="Of ROS images.", metavar="TOPIC", show_default="by name")
]
DepthTopicOption = Annotated[
    str | None,
    typer.Option(
        help='Of ROS images, aligned to colour; "" for none.',
        metavar="TOPIC",
        show_default="by name",
    ),
]
InfoTopicOption = Annotated[
    str | None,
    typer.Option(
        help="camera_info of colour images of ROS.", metavar="TOPIC", show_default="by name"
    ),
]

FramesOption = Annotated[
    int | None, typer.Option(min=1, help="Stop after so many frames.", show_default="no limit")
]
SecondsOption = Annotated[
    float | None, typer.Option(min=0, help="Stop after so long.", show_default="no limit")
]


def recording_topics(
    color: str | None, depth: str | None, info: str | None
) -> RecordingTopics | None:
    """The topics that were asked for, None without any: other sources have none."""
    from planegrasp.io.sources import RecordingTopics

    if color is None and depth is None and info is None:
        return None
    return RecordingTopics(color, depth, info)


def open_frames(
    source: str,
    *,
    camera: Path | None,
    fov: float | None,
    depth_scale: float | None,
    mode: tuple[int | None, int | None, int | None],
    topics: tuple[str | None, str | None, str | None],
    node: Transport | None = None,
) -> Camera | FrameSource:
    """What the options ask for, not started.

    Args:
        source: name of a camera, or of a file or folder.
        camera: camera file.
        fov: horizontal field of view in degrees.
        depth_scale: of depth images [m per unit].
        mode: width, height and rate of a camera.
        topics: of colour, depth and camera_info in a ROS recording or of a ROS camera.
        node: to read topics of ROS with.

    Raises:
        PlanegraspError: there is no such source, or the options do not fit it.
    """
    from planegrasp.io.cameras import is_camera_name, open_camera
    from planegrasp.io.sources import open_source

    angle = None if fov is None else math.radians(fov)
    asked = recording_topics(*topics)
    if is_camera_name(source):
        width, height, rate = mode
        return open_camera(
            source,
            camera=camera,
            field_of_view=angle,
            width=width,
            height=height,
            frames_per_second=rate,
            depth_scale=depth_scale,
            topics=asked,
            node=node,
        )
    if mode != (None, None, None):
        raise InvalidInputError(f"--width, --height and --fps are for cameras, {source} is none")
    return open_source(
        source,
        camera=camera,
        depth_scale=depth_scale,
        field_of_view=angle,
        topics=asked,
    )
