"""`planegrasp ros2`: a live system whose eyes and mouth are topics of ROS 2."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from planegrasp.cli.common import JsonOption, LibraryOption, messages, print_json, wanted_models
from planegrasp.cli.source_options import (
    CameraOption,
    ColorTopicOption,
    DepthScaleOption,
    DepthTopicOption,
    FieldOfViewOption,
    FramesOption,
    HeightOption,
    InfoTopicOption,
    RateOption,
    SecondsOption,
    SourceArgument,
    WidthOption,
    open_frames,
)
from planegrasp.cli.task_options import BudgetOption, WantOption, task_of

_ROS = "ROS"
_RETRY = 0.5  # a driver that was restarted is found again within so long [s]


def ros2(
    source: SourceArgument,
    *,
    library: LibraryOption = Path("objects"),
    want: WantOption = None,
    budget: BudgetOption = None,
    domain: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=232,
            help="DDS domain.",
            show_default="ROS_DOMAIN_ID, else 0",
            rich_help_panel=_ROS,
        ),
    ] = None,
    network: Annotated[
        str | None,
        typer.Option(
            help="Go onto the network, by this interface (eth0) or the one that fits (auto). "
            "Whoever is on it can read and write all topics.",
            metavar="INTERFACE",
            show_default="this computer only",
            rich_help_panel=_ROS,
        ),
    ] = None,
    namespace: Annotated[
        str, typer.Option(help="What topics begin with.", rich_help_panel=_ROS)
    ] = "/planegrasp",
    camera_frame: Annotated[
        str,
        typer.Option(
            help="Optical frame of a camera whose images do not name it.", rich_help_panel=_ROS
        ),
    ] = "camera_color_optical_frame",
    body_frame: Annotated[
        str,
        typer.Option(
            help='The camera\'s body frame, published with it on /tf_static; "" for none. '
            "ROS 2 cameras do that themselves.",
            rich_help_panel=_ROS,
        ),
    ] = "camera_link",
    frames: FramesOption = None,
    seconds: SecondsOption = None,
    camera: CameraOption = None,
    fov: FieldOfViewOption = None,
    depth_scale: DepthScaleOption = None,
    width: WidthOption = None,
    height: HeightOption = None,
    fps: RateOption = None,
    color_topic: ColorTopicOption = None,
    depth_topic: DepthTopicOption = None,
    info_topic: InfoTopicOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find and follow taught objects, and publish them for ROS 2, which need not be installed.

    SOURCE is ros2:/TOPIC for the colour image of a ROS 2 camera, ros2 for the only one, or any
    other camera or recording. It publishes detections, poses, transforms, markers and an image;
    tasks are set on the topic /planegrasp/task (docs/ros2.md).

        planegrasp ros2 ros2:/camera/color/image_raw --want book

        planegrasp ros2 realsense --network auto
    """
    from planegrasp.cli.live_run import LiveRun
    from planegrasp.cli.live_status import StatusLine
    from planegrasp.cli.ros2_output import Publish
    from planegrasp.cli.stopping import stop_on_signals
    from planegrasp.detector import Detector
    from planegrasp.io.cameras import NewestFrame, StreamConfig
    from planegrasp.io.cameras.ros2 import Ros2Camera
    from planegrasp.io.messages import FrameIds, Stamp, library_events
    from planegrasp.io.ros2 import LivePublisher, LiveTopics
    from planegrasp.io.ros2.dds import DdsConfig, DdsNode
    from planegrasp.io.ros2.task_topic import TaskTopic
    from planegrasp.live import Live

    ids, topics = FrameIds(camera=camera_frame), LiveTopics(namespace)
    models = tuple(wanted_models(library))
    task = task_of(want or [], budget)
    given = DdsConfig.from_environment()
    config = DdsConfig(
        given.domain if domain is None else domain, given.network if network is None else network
    )
    with ExitStack() as stack:
        stop = stack.enter_context(stop_on_signals())
        node = stack.enter_context(DdsNode(config))
        opened = open_frames(
            source,
            camera=camera,
            fov=fov,
            depth_scale=depth_scale,
            mode=(width, height, fps),
            topics=(color_topic, depth_topic, info_topic),
            node=node,
        )
        with messages().status("learning the objects …"):
            detector = Detector(models)
        finder = stack.enter_context(Live(detector, task))
        header_of = opened.header_of if isinstance(opened, Ros2Camera) else None
        publisher = LivePublisher(node, models, ids, topics, "" if header_of else body_frame)
        stack.enter_context(publisher).library(library_events((), models, Stamp()))
        tasks = TaskTopic(node, topics.task, finder.names, task.budget)
        # Nodes of ROS start in any order.
        waiting = StreamConfig(wait_at_start=header_of is not None, longest_retry=_RETRY)
        stream = stack.enter_context(NewestFrame(opened, waiting))
        status = stack.enter_context(StatusLine())
        for note in stream.notes:
            status.event("note", note, "yellow")
        outputs = [Publish(publisher, header_of)]
        run = LiveRun(source, finder, stream, outputs, status, tasks, frames, seconds)
        try:
            run.run(stop)
        finally:
            run.finish()
    if as_json:
        print_json(run.to_dict())
    else:
        run.print_summary()
