"""A live system that publishes on ROS 2 while who listens is killed and started again."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from planegrasp.bench.ros2_peer import Endpoint, Peer
from planegrasp.bench.soak import SETTLED, memory_growth, resident
from planegrasp.closing import ClosesAtEnd
from planegrasp.errors import InvalidInputError
from planegrasp.io.messages import library_events
from planegrasp.io.messages.header import Stamp
from planegrasp.io.ros2 import LivePublisher
from planegrasp.io.ros2.dds import DdsConfig, DdsNode
from planegrasp.live import Live

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from planegrasp.bench.ros2_seen import Seen

_RATE = 30.0
_LONGEST_WAIT = 20.0  # for the peer to hear something on each topic [s]


@dataclass(frozen=True, slots=True)
class Restarts:
    """What happened.

    Attributes:
        frames: that were published.
        again: from each start of the peer until it had heard something on every topic [s]; NaN
            where it did not, or was killed before.
        publish_ms: of each frame: how long publishing took.
        late_ms: the longest that a frame was behind its time, after the first second.
        refused: messages that found no room.
        memory: of this process over the run [MB].
    """

    frames: int
    again: tuple[float, ...]
    publish_ms: tuple[float, ...]
    late_ms: float
    refused: int
    memory: tuple[float, ...]

    @property
    def growth(self) -> float:
        """Of memory after a tenth of the frames [MB], see `memory_growth`."""
        return memory_growth(self.memory[int(SETTLED * len(self.memory)) :])


def frames_between(frames: int, kills: int) -> int:
    """How many frames there are from one kill to the next.

    Raises:
        InvalidInputError: there is none.
    """
    if frames <= kills:
        raise InvalidInputError(
            f"{kills} kills need at least {kills + 1} frames, one between each two; got {frames}"
        )
    return frames // (kills + 1)


def publish_on(
    seen: Seen,
    domain: int,
    program: Path | None,
    *,
    frames: int,
    kills: int,
    advance: Callable[[], None],
) -> Restarts:
    """Publish all topics at 30 Hz; the peer is killed at even intervals.

    Args:
        seen: what is published.
        domain: of DDS.
        program: of the peer.
        frames: how many are published.
        kills: how often the peer is killed (SIGKILL) and started again.
        advance: called every tenth frame.

    Raises:
        InvalidInputError: there are not more frames than kills.
        PlanegraspError: the peer did not start.
    """
    between = frames_between(frames, kills)
    shown = [*seen.frames, *seen.frames[-2:0:-1]]
    (model,) = seen.objects
    publish_ms, memory, late = [], [], 0.0
    with (
        DdsNode(DdsConfig(domain)) as node,
        LivePublisher(node, seen.objects, body_frame="camera_link") as publisher,
        Live(seen.detector) as live,
        _Restarted(domain, _topics(model.name), program) as restarted,
    ):
        publisher.library(library_events((), seen.objects, Stamp()))
        begun = time.monotonic()
        for number in range(frames):
            due = begun + number / _RATE
            time.sleep(max(due - time.monotonic(), 0.0))
            if number and number % between == 0 and number // between <= kills:
                restarted.kill()
            found = live.process(replace(shown[number % len(shown)], timestamp=time.time()))
            before = time.monotonic()
            publisher.publish(found)
            after = time.monotonic()
            publish_ms.append(1000 * (after - before))
            if number >= _RATE:
                late = max(late, 1000 * (before - due))
            if number % 10 == 9:
                memory.append(resident())
                advance()
                restarted.check()
        again = restarted.finish()
        refused = publisher.refused
    return Restarts(frames, again[1:], tuple(publish_ms), late, refused, tuple(memory))


class _Restarted(ClosesAtEnd):
    """A peer that a thread starts again whenever it was killed: publishing does not wait for it."""

    def __init__(self, domain: int, reads: Sequence[Endpoint], program: Path | None) -> None:
        self._start: Callable[[], Peer] = lambda: Peer(domain, reads, (), program, brief=True)
        self._topics = {one.topic for one in reads}
        self._again: list[float] = []
        self._asked = 0
        self._ended = threading.Event()
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def kill(self) -> None:
        """Kill the peer, also one that only just starts; it is started again at once."""
        self._asked += 1

    def check(self) -> None:
        """Raise what ended the restarting, if anything did.

        Raises:
            PlanegraspError: the peer did not start.
        """
        if self._failure is not None:
            raise self._failure

    def finish(self) -> tuple[float, ...]:
        """End it; how long it took after each start until it had heard something everywhere.

        Raises:
            PlanegraspError: the peer did not start.
        """
        self.close()
        self.check()
        return tuple(self._again)

    def close(self) -> None:
        """End it."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        try:
            # One start for the beginning, and one for each kill, however soon after another.
            while not self._ended.is_set() or len(self._again) <= self._asked:
                with self._start() as peer:
                    number = len(self._again)
                    self._again.append(self._heard(peer, number))
                    while not self._is_due(number):
                        peer.next(0.1)
                    peer.kill()
        except Exception as error:
            self._failure = error

    def _is_due(self, number: int) -> bool:
        """Whether a start is to be killed."""
        return self._asked > number or self._ended.is_set()

    def _heard(self, peer: Peer, number: int) -> float:
        missing = set(self._topics)
        while time.time() < peer.started + _LONGEST_WAIT and not self._is_due(number):
            line = peer.next(0.1)
            if line is not None and line.get("topic") in missing:
                missing.remove(line["topic"])
                if not missing:
                    return float(line["at"] / 1e9 - peer.started)
        return float(np.nan)


def _topics(name: str) -> list[Endpoint]:
    """All that is published while an object is seen."""
    whole = "/planegrasp"
    return [
        Endpoint(f"{whole}/detections", "vision_msgs/msg/Detection3DArray"),
        Endpoint(f"{whole}/markers", "visualization_msgs/msg/MarkerArray"),
        Endpoint(f"{whole}/overlay", "sensor_msgs/msg/Image"),
        Endpoint(f"{whole}/events", "std_msgs/msg/String", "kept"),
        Endpoint(f"{whole}/objects/{name}/pose", "geometry_msgs/msg/PoseWithCovarianceStamped"),
        Endpoint("/tf", "tf2_msgs/msg/TFMessage", "tf"),
        Endpoint("/tf_static", "tf2_msgs/msg/TFMessage", "kept"),
    ]
