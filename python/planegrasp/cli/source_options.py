"""Options of the commands that read frames from cameras and recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from planegrasp.io.sources import RecordingTopics

SourceArgument = Annotated[
    str,
    typer.Argument(
        help="A camera (realsense, realsense:SERIAL, openni, opencv:0, opencv:URL), or anything "
        "that `detect` reads.",
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
    str | None, typer.Option(help="Of a ROS recording.", metavar="TOPIC", show_default="by name")
]
DepthTopicOption = Annotated[
    str | None,
    typer.Option(
        help='Of a ROS recording, aligned to colour; "" for none.',
        metavar="TOPIC",
        show_default="by name",
    ),
]
InfoTopicOption = Annotated[
    str | None,
    typer.Option(
        help="camera_info of colour in a ROS recording.", metavar="TOPIC", show_default="by name"
    ),
]


def recording_topics(
    color: str | None, depth: str | None, info: str | None
) -> RecordingTopics | None:
    """The topics that were asked for, None without any: other sources have none."""
    from planegrasp.io.sources import RecordingTopics

    if color is None and depth is None and info is None:
        return None
    return RecordingTopics(color, depth, info)
