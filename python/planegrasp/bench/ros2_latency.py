"""How much later than a call in the process detections come over ROS 2."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.bench.ros2_peer import Endpoint, Peer
from planegrasp.errors import CameraLostError
from planegrasp.io.cameras import NewestFrame, StreamConfig
from planegrasp.io.cameras.ros2 import Ros2Camera
from planegrasp.io.messages import Header, Stamp
from planegrasp.io.ros2 import LivePublisher, LiveTopics
from planegrasp.io.ros2.conversions import camera_info_message, image_message
from planegrasp.io.ros2.dds import DdsConfig, DdsNode, dds_type
from planegrasp.io.ros2.dds.as_json import message_to_json
from planegrasp.io.sources import RecordingTopics
from planegrasp.live import Live, prompt

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from planegrasp.bench.ros2_seen import Seen
    from planegrasp.rgbd import RGBDFrame

_COLOR, _DEPTH, _INFO = "/camera/color", "/camera/depth", "/camera/info"
_IMAGE = "sensor_msgs/msg/Image"
_DETECTIONS = "vision_msgs/msg/Detection3DArray"
_RATE = 30.0
_SETTLING = 2.0  # until both have found each other and all is warm [s]
_ENDLESS = 1_000_000  # frames: the peer is killed before
_BILLION = 1_000_000_000
_MILLION = 1_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Latency:
    """Times of frames, each an array of n [ms].

    Attributes:
        arriving: from before the peer publishes until the frame is there to be looked at.
        process: of the call that detects.
        leaving: from then until the peer has the detections.
        lost: frames of which the peer got none.
    """

    arriving: NDArray[np.float64]
    process: NDArray[np.float64]
    leaving: NDArray[np.float64]
    lost: int

    @property
    def added(self) -> NDArray[np.float64]:
        """All but the call."""
        return self.arriving + self.leaving


def measure_latency(
    seen: Seen, domain: int, program: Path | None, frames: int, advance: Callable[[], None]
) -> Latency:
    """Let a peer publish frames of a camera at 30 Hz, and hear what is detected in them.

    Args:
        seen: what the camera shows.
        domain: of DDS.
        program: of the peer.
        frames: how many count.
        advance: called every tenth frame.

    Raises:
        CameraLostError: no frames come.
    """
    played = [_messages(frame) for frame in seen.frames]
    played += played[-2:0:-1]
    writes = [
        Endpoint(_INFO, "sensor_msgs/msg/CameraInfo"),
        Endpoint(_DEPTH, _IMAGE),
        Endpoint(_COLOR, _IMAGE),
    ]
    reads = [Endpoint(LiveTopics().detections, _DETECTIONS)]
    with (
        DdsNode(DdsConfig(domain)) as node,
        LivePublisher(node, seen.objects) as publisher,
        Peer(domain, reads, writes, program, brief=True) as peer,
    ):
        peer.play(played, _RATE, _ENDLESS)
        camera = Ros2Camera(_COLOR, RecordingTopics(_COLOR, _DEPTH, _INFO), node=node)
        begun = _Begun()
        heard: dict[int, int] = {}
        waiting = StreamConfig(wait_at_start=True)
        with prompt(), Live(seen.detector) as live, NewestFrame(camera, waiting) as newest:
            settled = None
            while len(begun.stamps) < frames:
                frame = newest.next(timeout=10.0)
                if frame is None:
                    raise CameraLostError(f"no frame came for 10 s, after {len(begun.stamps)}")
                header = camera.header_of(frame)
                before = time.time_ns()
                found = live.process(frame)
                after = time.time_ns()
                publisher.publish(found, header)
                settled = settled or before + round(_SETTLING * _BILLION)
                if header is not None and frame.depth is not None and before > settled:
                    begun.add(header.stamp.total_nanoseconds, before, after)
                    if len(begun.stamps) % 10 == 0:
                        advance()
                _hear(heard, peer.taken())
        time.sleep(0.5)
        _hear(heard, peer.taken())
        peer.kill()
    return begun.latency(heard)


class _Begun:
    """Frames that were processed: their stamps, and when that began and ended [ns]."""

    def __init__(self) -> None:
        self.stamps: list[int] = []
        self._times: list[tuple[int, int]] = []

    def add(self, stamp: int, before: int, after: int) -> None:
        """Note a frame."""
        self.stamps.append(stamp)
        self._times.append((before, after))

    def latency(self, heard: dict[int, int]) -> Latency:
        """Given when the peer heard of the frames, by their stamps [ns]."""
        times = np.array(
            [
                (before - stamp, after - before, heard[stamp] - after)
                for stamp, (before, after) in zip(self.stamps, self._times, strict=True)
                if stamp in heard
            ],
            dtype=np.float64,
        ).reshape(-1, 3)
        arriving, process, leaving = times.T / _MILLION
        return Latency(arriving, process, leaving, len(self.stamps) - len(times))


def _hear(heard: dict[int, int], lines: list[dict[str, Any]]) -> None:
    for line in lines:
        if "at" in line:
            heard[line["stamp"]["sec"] * _BILLION + line["stamp"]["nanosec"]] = line["at"]


def _messages(frame: RGBDFrame) -> list[tuple[str, Any]]:
    """As a driver publishes a frame: colour last, depth in millimetres."""
    assert frame.depth is not None
    header = Header(Stamp(), "camera_color_optical_frame")
    millimetres = np.round(1000 * frame.depth).astype(np.uint16)
    messages = [
        (_INFO, camera_info_message(dds_type, header, frame.camera)),
        (_DEPTH, image_message(dds_type, header, millimetres, "16UC1")),
        (_COLOR, image_message(dds_type, header, frame.color, "rgb8")),
    ]
    return [(topic, message_to_json(message)) for topic, message in messages]
