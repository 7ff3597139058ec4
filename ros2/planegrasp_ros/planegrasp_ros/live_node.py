"""A node that finds and follows taught objects in the images of a camera of ROS 2."""

from __future__ import annotations

import threading
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from planegrasp.cli.common import wanted_models
from planegrasp.cli.live_run import LiveRun
from planegrasp.cli.ros2_output import Publish
from planegrasp.cli.stopping import stop_on_signals
from planegrasp.cli.task_options import task_of
from planegrasp.detector import Detector
from planegrasp.errors import PlanegraspError
from planegrasp.io.camera_file import read_camera
from planegrasp.io.cameras import NewestFrame, StreamConfig
from planegrasp.io.cameras.ros2 import Ros2Camera
from planegrasp.io.messages import Stamp, library_events
from planegrasp.io.ros2 import LivePublisher, LiveTopics
from planegrasp.io.ros2.task_topic import TaskTopic
from planegrasp.io.sources import RecordingTopics
from planegrasp.live import Live
from planegrasp_ros.rclpy_transport import RclpyTransport

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rclpy.node import Node

PARAMETERS = {
    "library": "objects",
    "color_topic": "/camera/color/image_raw",
    "depth_topic": "",
    "info_topic": "",
    "use_depth": True,
    "camera_file": "",
    "depth_scale": 0.001,
    "namespace": "/planegrasp",
    "want": [""],
    "budget": 25.0,
}
"""Defaults; what they mean is in config/planegrasp.yaml."""

_RETRY = 0.5  # a driver that was restarted is found again within so long [s]


class Log:
    """Takes what a live run has to say into the node's log."""

    def __init__(self, node: Node) -> None:
        self._logger = node.get_logger()

    def event(self, kind: str, text: str, style: str = "") -> None:
        """Log what happened."""
        say = self._logger.warning if style == "yellow" else self._logger.info
        say(f"{kind}: {text}")

    def show(self, *state: Any) -> None:
        """The state is on the topics."""


def run(node: Node, stop: threading.Event) -> None:
    """Find, follow and publish until it is told to stop; somebody else spins the node.

    Raises:
        PlanegraspError: the library or a parameter is not what it should be.
    """
    given = {
        name: node.declare_parameter(name, default).value for name, default in PARAMETERS.items()
    }
    models = tuple(wanted_models(Path(given["library"]).expanduser()))
    task = task_of([text for text in given["want"] if text], given["budget"])
    asked = RecordingTopics(
        given["color_topic"] or None,
        (given["depth_topic"] or None) if given["use_depth"] else "",
        given["info_topic"] or None,
    )
    intrinsics = read_camera(given["camera_file"])[0] if given["camera_file"] else None
    topics = LiveTopics(given["namespace"])
    with ExitStack() as stack:
        transport = stack.enter_context(RclpyTransport(node))
        camera = Ros2Camera("", asked, intrinsics, given["depth_scale"], transport)
        live = stack.enter_context(Live(Detector(models), task))
        publisher = stack.enter_context(LivePublisher(transport, models, topics=topics))
        publisher.library(library_events((), models, Stamp()))
        tasks = TaskTopic(transport, topics.task, live.names, task.budget)
        waiting = StreamConfig(wait_at_start=True, longest_retry=_RETRY)
        stream = stack.enter_context(NewestFrame(camera, waiting))
        outputs = [Publish(publisher, camera.header_of)]
        endless = LiveRun(camera.name, live, stream, outputs, Log(node), tasks)
        try:
            endless.run(stop)
        finally:
            endless.finish()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until Ctrl-C."""
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("planegrasp")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinning = threading.Thread(target=_spin, args=(executor,), daemon=True)
    spinning.start()
    code = 0
    try:
        with stop_on_signals() as stop:
            run(node, stop)
    except PlanegraspError as error:
        node.get_logger().error(str(error))
        code = 1
    finally:
        executor.shutdown()
        spinning.join(1.0)
        node.destroy_node()
        rclpy.try_shutdown()
    return code


def _spin(executor: SingleThreadedExecutor) -> None:
    with suppress(ExternalShutdownException):
        executor.spin()
