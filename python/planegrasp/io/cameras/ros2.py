"""Cameras whose driver publishes on ROS 2."""

from __future__ import annotations

import time
from collections import OrderedDict
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from planegrasp.errors import CameraError, CameraLostError, InvalidInputError, SourceError
from planegrasp.io.cameras.ros2_images import FrameMaker
from planegrasp.io.cameras.ros2_topic import OneTopic
from planegrasp.io.images import MILLIMETRES
from planegrasp.io.pairing import FramePairing
from planegrasp.io.ros2.names import check_topic
from planegrasp.io.sources.ros_topics import RecordingTopics, choose_topics

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planegrasp.geometry import PinholeCamera
    from planegrasp.io.messages.header import Header
    from planegrasp.io.ros2.transport import Transport, Waiting
    from planegrasp.rgbd import RGBDFrame

__all__ = ["Ros2Camera"]

_TIMEOUT = 2.0  # without a frame that is of use [s]
_GLANCE = 0.05  # between looks for topics [s]
_SETTLING = 0.3  # topics of one driver appear within so long [s]
_LARGEST_GAP = 1 / 60  # between the stamps of a colour image and its depth [s]
_PATIENCE = 2  # colour images that wait for their depth
_UNPAIRED = 30  # colour images without depth, while depth comes, that are worth a word
_KEPT_HEADERS = 64
_MOST_REPORTS = 100


class Ros2Camera:
    """A `Camera` by the topics of a ROS 2 driver.

    Colour goes with the depth whose stamp is nearest, within 1/60 s; else it comes without depth.
    Of several publishers of a topic the first one heard is listened to until it is silent. What is
    of no use is left out, and reported once.

    Attributes:
        name: as for `open_camera`.
        notes: what is to be known of the lens, once there was a camera_info.
        topics: what is read, once it is open.
    """

    def __init__(
        self,
        topic: str = "",
        topics: RecordingTopics | None = None,
        camera: PinholeCamera | None = None,
        depth_scale: float | None = None,
        node: Transport | Callable[[], Transport] | None = None,
    ) -> None:
        """Remember what to open.

        Args:
            topic: of the colour image; the one that is named like one where it is empty.
            topics: of depth and camera_info; by name where they are None.
            camera: intrinsics of the colour image, instead of those of its camera_info.
            depth_scale: metres per unit of 16UC1.
            node: to read with; by default one of its own, as the environment says
                (`DdsConfig.from_environment`).

        Raises:
            InvalidInputError: no topic can be named so.
        """
        self.name = f"ros2:{topic}" if topic else "ros2"
        self.topics = RecordingTopics()
        self._asked = topics or RecordingTopics()
        if topic:
            self._asked = replace(self._asked, color=topic)
        for name in (self._asked.color, self._asked.depth, self._asked.info):
            if name:
                check_topic(name)
        self._frames = FrameMaker(camera, depth_scale or MILLIMETRES)
        self._given_node = node
        self._node: Transport | None = None
        self._color: OneTopic | None = None
        self._depth: OneTopic | None = None
        self._info: OneTopic | None = None
        self._waiting: Waiting | None = None
        self._pairing: FramePairing[Any, Any] = FramePairing(_LARGEST_GAP)
        self._ready: list[RGBDFrame] = []
        self._reports: list[str] = []
        self._said: set[str] = set()
        self._headers: OrderedDict[str, Header] = OrderedDict()
        self._number = 0
        self._unpaired = 0

    @property
    def notes(self) -> tuple[str, ...]:
        """See `Camera.notes`."""
        return self._frames.notes

    def header_of(self, frame: RGBDFrame) -> Header | None:
        """Stamp and frame of the colour image that a frame was made of, exactly as it came.

        None for a frame of another camera, or one that was read more than 64 frames ago.
        """
        return self._headers.get(frame.name)

    def take_reports(self) -> list[str]:
        """See `Reporting.take_reports`."""
        reports, self._reports = self._reports, []
        return reports

    def open(self) -> None:
        """See `Camera.open`.

        Raises:
            CameraLostError: nobody publishes such images, or there is no one choice of them.
            NetworkError: the network interface is not there.
        """
        if self._color is not None:
            return
        node = self._open_node()
        try:
            self.topics = self._found_topics(node)
            self._color = self._subscribed(node, self.topics.color)
            self._depth = self._subscribed(node, self.topics.depth)
            self._info = self._subscribed(node, self.topics.info)
            readers = [o.reader for o in (self._color, self._depth, self._info) if o is not None]
            self._waiting = node.waiting(readers)
        except BaseException:
            self.close()
            raise
        self._pairing = FramePairing(_LARGEST_GAP, _PATIENCE if self._depth else 0)
        self._unpaired = 0

    def read(self) -> RGBDFrame:
        """See `Camera.read`."""
        if self._waiting is None:
            raise CameraLostError(f"{self.name} is not open")
        deadline = time.monotonic() + _TIMEOUT
        while not self._ready:
            left = deadline - time.monotonic()
            if left <= 0:
                raise CameraLostError(f"{self.name}: {self._reason()}")
            self._waiting.wait(left)
            self._take()
        # Newer frames make older ones pointless.
        frame, self._ready = self._ready[-1], []
        return frame

    def close(self) -> None:
        """See `Camera.close`."""
        if self._waiting is not None:
            self._waiting.close()
            self._waiting = None
        for one in (self._color, self._depth, self._info):
            if one is not None:
                one.reader.close()
        self._color = self._depth = self._info = None
        self._ready = []
        if self._node is not None and self._node is not self._given_node:
            self._node.close()
        self._node = None

    def _open_node(self) -> Transport:
        if self._given_node is None:
            from planegrasp.io.ros2.dds import DdsConfig, DdsNode

            self._node = DdsNode(DdsConfig.from_environment())
        elif callable(self._given_node):
            self._node = self._given_node()
        else:
            self._node = self._given_node
        return self._node

    def _found_topics(self, node: Transport) -> RecordingTopics:
        """The topics to read, when there are some."""
        needs_info = not self._frames.is_calibrated
        where = node.where
        deadline = time.monotonic() + _TIMEOUT
        settled: float | None = None
        while True:
            types = {topic: one.message for topic, one in node.published().items()}
            try:
                found = choose_topics(types, self._asked, needs_info=needs_info, where=where)
            except SourceError as error:
                if time.monotonic() > deadline:
                    raise CameraLostError(f"{self.name} is not there: {error}") from error
            else:
                settled = settled or time.monotonic() + _SETTLING
                if time.monotonic() >= settled or None not in (self._asked.depth, self._asked.info):
                    return found
            time.sleep(_GLANCE)

    def _subscribed(self, node: Transport, topic: str | None) -> OneTopic | None:
        if not topic:
            return None
        published = node.published().get(topic)
        if published is None:
            raise CameraLostError(f"{self.name}: {topic} is gone")
        return OneTopic.of(node, topic, published)

    def _take(self) -> None:
        assert self._color is not None
        if self._info is not None:
            for message in self._info.take(self._say):
                with self._leaving_out(self._info):
                    self._frames.calibrate(message)
        pairs = []
        if self._depth is not None:
            for message in self._depth.take(self._say):
                pairs += self._pairing.second(_stamp(message), message)
        for message in self._color.take(self._say):
            pairs += self._pairing.first(_stamp(message), message)
        for stamp, color, depth in pairs:
            self._note_pair(stamp, depth)
            with self._leaving_out(self._color):
                self._make(color, depth, stamp)

    def _make(self, color: Any, depth: Any, stamp: float) -> None:
        name = f"{self._number:06d}"
        frame = self._frames.frame(color, depth, name, stamp, self._say)
        if frame is None:
            return
        self._number += 1
        self._headers[name] = self._frames.header(color, stamp)
        if len(self._headers) > _KEPT_HEADERS:
            self._headers.popitem(last=False)
        self._ready.append(frame)

    @contextmanager
    def _leaving_out(self, one: OneTopic) -> Iterator[None]:
        """Leave out a message that is of no use, and say so."""
        try:
            yield
        except (SourceError, CameraError, InvalidInputError) as error:
            self._say(f"{one.reader.topic}: {error}; left out")

    def _note_pair(self, stamp: float, depth: Any) -> None:
        if depth is not None or self._depth is None or self._depth.latest is None:
            self._unpaired = 0
            return
        self._unpaired += 1
        if self._unpaired == _UNPAIRED:
            apart = abs(_stamp(self._depth.latest) - stamp)
            self._say(
                f"stamps of {self._depth.reader.topic} never come within "
                f"{1000 * _LARGEST_GAP:.0f} ms of those of {self.topics.color} (now {apart:.3g} s "
                f"apart): frames go without depth",
                about="stamps",
            )

    def _say(self, text: str, about: str = "") -> None:
        """Report something, unless the same (`about`, else the text) was reported before."""
        if (about or text) not in self._said and len(self._said) < _MOST_REPORTS:
            self._said.add(about or text)
            self._reports.append(text)

    def _reason(self) -> str:
        assert self._color is not None
        if self._color.latest is None:
            return f"{self.topics.color} gives no images any more"
        if not self._frames.is_calibrated:
            return f"no camera_info has come on {self.topics.info}: give a camera file"
        return self._frames.failure or f"{self.topics.color} gives no images any more"


def _stamp(message: Any) -> float:
    """When an image was taken [s], or now where its header does not say."""
    stamp = message.header.stamp
    seconds = stamp.sec + stamp.nanosec * 1e-9
    return float(seconds) if seconds > 0 else time.time()
