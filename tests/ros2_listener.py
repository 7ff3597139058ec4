"""Images in, and all that `planegrasp ros2` publishes of them."""

from __future__ import annotations

import json
import time
from itertools import cycle

from rendered_stream import shots, taught
from ros2_driver import Driver, until

from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.io.ros2.profiles import KEPT

NAME = taught()[0].name
OUTPUTS = {
    "/planegrasp/detections": "vision_msgs/msg/Detection3DArray",
    f"/planegrasp/objects/{NAME}/pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/planegrasp/overlay": "sensor_msgs/msg/Image",
    "/planegrasp/markers": "visualization_msgs/msg/MarkerArray",
    "/tf": "tf2_msgs/msg/TFMessage",
}


def transform(pose):
    p, q = pose.position, pose.orientation
    turn = Rotation.from_quat([q.x, q.y, q.z, q.w])
    return RigidTransform.from_components([p.x, p.y, p.z], turn)


def nanoseconds(header):
    return header.stamp.sec * 10**9 + header.stamp.nanosec


class Listener:
    """Keeps what comes on each topic by the stamp of its image."""

    def __init__(self, node):
        self.readers = {topic: node.reader(topic, kind) for topic, kind in OUTPUTS.items()}
        self.events = node.reader("/planegrasp/events", "std_msgs/msg/String", KEPT)
        self.by_stamp = {}
        self.said = []

    def take(self):
        for topic, reader in self.readers.items():
            for message, _ in reader.take():
                self.by_stamp.setdefault(self.stamp(message), {})[topic] = message
        self.said += [json.loads(message.data) for message, _ in self.events.take()]

    @staticmethod
    def stamp(message):
        for members in ("transforms", "markers"):
            if hasattr(message, members):
                return nanoseconds(getattr(message, members)[0].header)
        return nanoseconds(message.header)

    def complete(self):
        """Stamps with a message on each topic."""
        return [stamp for stamp, found in self.by_stamp.items() if len(found) == len(OUTPUTS)]


class Feed:
    """Publishes the rendered stream to and fro, and listens."""

    def __init__(self, node):
        first = shots()[0].frame
        self.listener = Listener(node)
        self.truth = {}
        self._shots = cycle([*shots(), *shots()[::-1]])
        self._driver = Driver(node, depth=first.depth, camera=first.camera)

    def until(self, condition):
        """Publish at 30 Hz until a condition holds."""
        until(lambda: self._send() or condition(), 60.0)

    def _send(self):
        shot = next(self._shots)
        header = self._driver.send_frame(shot.frame)
        self.truth[header.stamp.total_nanoseconds] = shot
        time.sleep(1 / 30)
        self.listener.take()
