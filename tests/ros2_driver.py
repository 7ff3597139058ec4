"""A camera driver of ROS 2, as far as a subscriber can tell."""

from __future__ import annotations

import os
import random
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planegrasp.geometry import PinholeCamera
from planegrasp.io.messages import Header, Stamp
from planegrasp.io.ros2.conversions import camera_info_message, image_message

COLOR = "/camera/color/image_raw"
INFO = "/camera/color/camera_info"
DEPTH = "/camera/aligned_depth_to_color/image_raw"
CAMERA = PinholeCamera(64, 48, 60.0, 61.0, 31.5, 23.5)


def free_domain():
    """A DDS domain that no other test uses at this time: for certain not one of another worker."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
    return random.SystemRandom().choice(range(1 + worker % 4, 101, 4))


def color_image(number=0):
    rng = np.random.default_rng(number)
    return rng.integers(0, 256, (CAMERA.height, CAMERA.width, 3), np.uint8)


def depth_image(number=0):
    rng = np.random.default_rng(number)
    return rng.uniform(0.5, 2.0, (CAMERA.height, CAMERA.width)).astype(np.float32)


@dataclass
class Driver:
    """Publishes a colour image with camera_info and depth, as its fields say.

    Attributes:
        node: to publish with.
        color: pixels.
        encoding: of colour.
        depth: pixels, None for none.
        depth_encoding: of depth.
        camera: of the camera_info, None for none.
        depth_shift: of the stamps of depth [s].
        frame_id: of the images.
    """

    node: Any
    color: Any = field(default_factory=color_image)
    encoding: str = "rgb8"
    depth: Any = field(default_factory=depth_image)
    depth_encoding: str = "32FC1"
    camera: Any = CAMERA
    depth_shift: float = 0.0
    frame_id: str = "left_optical"
    sent: int = 0

    def __post_init__(self):
        self._color = self.node.writer(COLOR, "sensor_msgs/msg/Image")
        self._info = self._depth = None
        if self.camera is not None:
            self._info = self.node.writer(INFO, "sensor_msgs/msg/CameraInfo")
        if self.depth is not None:
            self._depth = self.node.writer(DEPTH, "sensor_msgs/msg/Image")

    def send_frame(self, frame, nanoseconds=None):
        """Publish what an `RGBDFrame` has, of the same camera."""
        self.color, self.depth, self.camera = frame.color, frame.depth, frame.camera
        return self.send(nanoseconds)

    def send(self, nanoseconds=None):
        """Publish one frame."""
        taken = time.time_ns() if nanoseconds is None else nanoseconds
        header = Header(Stamp.from_nanoseconds(taken), self.frame_id)
        if self._info is not None:
            self._info.write(camera_info_message(self.node.types, header, self.camera))
        if self._depth is not None:
            stamp = Stamp.from_nanoseconds(taken + round(self.depth_shift * 1e9))
            later = Header(stamp, self.frame_id)
            self._depth.write(
                image_message(self.node.types, later, self.depth, self.depth_encoding)
            )
        self._color.write(image_message(self.node.types, header, self.color, self.encoding))
        self.sent += 1
        return header

    @contextmanager
    def running(self, rate=50.0):
        """Publish in a thread."""
        stop = threading.Event()

        def work():
            while not stop.wait(1 / rate):
                self.send()

        thread = threading.Thread(target=work)
        thread.start()
        try:
            yield self
        finally:
            stop.set()
            thread.join()

    def close(self):
        for writer in (self._color, self._info, self._depth):
            if writer is not None:
                writer.close()


def main():
    """A process of its own that publishes until it is killed: DOMAIN, number of the image."""
    from planegrasp.io.ros2.dds import DdsConfig, DdsNode

    with DdsNode(DdsConfig(int(sys.argv[1]))) as node:
        driver = Driver(node, color=color_image(int(sys.argv[2])))
        print("ready", flush=True)
        while True:
            driver.send()
            time.sleep(0.02)


def until(condition, seconds=20.0):
    """The first value of a function that is true; far more time than it takes is allowed [s]."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.005)
    return value


if __name__ == "__main__":
    main()
