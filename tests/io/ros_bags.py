"""Writing small ROS recordings with rosbags, whose writers are not ours."""

from __future__ import annotations

import cv2
import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
INFO, STRING = "sensor_msgs/msg/CameraInfo", "std_msgs/msg/String"
COLOR = "/camera/color/image_raw"
COLOR_INFO = "/camera/color/camera_info"
DEPTH = "/camera/aligned_depth_to_color/image_raw"
DEPTH_INFO = "/camera/aligned_depth_to_color/camera_info"


class Bag:
    """Messages that are collected, and written in one of the formats."""

    def __init__(self, kind):
        self.kind = kind
        self.types = get_typestore(Stores.ROS1_NOETIC if kind == "bag" else Stores.ROS2_HUMBLE)
        self.messages = []

    def make(self, name, **fields):
        return self.types.types[name](**fields)

    def header(self, stamp):
        time = self.make(
            "builtin_interfaces/msg/Time",
            sec=int(stamp),
            nanosec=round((stamp - int(stamp)) * 1e9),
        )
        extra = {"seq": 0} if self.kind == "bag" else {}
        return self.make("std_msgs/msg/Header", stamp=time, frame_id="camera", **extra)

    def add(self, topic, message, stamp):
        self.messages.append((topic, message, stamp))

    def image(self, topic, pixels, encoding, stamp, *, padding=0, bigendian=False, recorded=None):
        """An image, with rows padded by so many bytes."""
        height, width = pixels.shape[:2]
        order = ">" if bigendian else "<"
        rows = np.ascontiguousarray(pixels, pixels.dtype.newbyteorder(order))
        rows = rows.reshape(height, -1).view(np.uint8)
        rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
        message = self.make(
            IMAGE,
            header=self.header(stamp),
            height=height,
            width=width,
            encoding=encoding,
            is_bigendian=int(bigendian),
            step=rows.shape[1],
            data=rows.reshape(-1),
        )
        self.add(topic, message, recorded or stamp or 1.0)

    def compressed(self, topic, data, described, stamp):
        message = self.make(
            COMPRESSED,
            header=self.header(stamp),
            format=described,
            data=np.frombuffer(bytes(data), np.uint8),
        )
        self.add(topic, message, stamp)

    def info(self, topic, camera, stamp, *, model="plumb_bob", d=None, p=None):
        P = np.zeros((3, 4))
        P[:, :3] = camera.matrix
        d = camera.coefficients if d is None else np.asarray(d, dtype=np.float64)
        arrays = {
            "d": d,
            "k": camera.matrix.ravel(),
            "r": np.eye(3).ravel(),
            "p": P.ravel() if p is None else np.asarray(p, dtype=np.float64),
        }
        if self.kind == "bag":
            arrays = {key.upper(): value for key, value in arrays.items()}
        message = self.make(
            INFO,
            header=self.header(stamp),
            height=camera.height,
            width=camera.width,
            distortion_model=model,
            binning_x=0,
            binning_y=0,
            roi=self.make(
                "sensor_msgs/msg/RegionOfInterest",
                x_offset=0,
                y_offset=0,
                height=0,
                width=0,
                do_rectify=False,
            ),
            **arrays,
        )
        self.add(topic, message, stamp)

    def text(self, topic, stamp):
        self.add(topic, self.make(STRING, data="hello"), stamp)

    def frame(self, frame, *, depth_stamp=None):
        """A frame as a RealSense node publishes it."""
        stamp = frame.timestamp
        self.info(COLOR_INFO, frame.camera, stamp)
        self.image(COLOR, frame.color, "rgb8", stamp)
        if frame.depth is not None:
            units = np.rint(frame.depth * 1000).astype(np.uint16)
            self.image(DEPTH, units, "16UC1", stamp if depth_stamp is None else depth_stamp)

    def write(self, folder):
        """Write it into a folder.

        Returns:
            The path to open.
        """
        if self.kind == "bag":
            path = folder / "run.bag"
            serialize = self.types.serialize_ros1
            writer = Writer1(path)
        else:
            path = folder / "run"
            plugin = StoragePlugin.SQLITE3 if self.kind == "sqlite3" else StoragePlugin.MCAP
            serialize = self.types.serialize_cdr
            writer = Writer2(path, version=9, storage_plugin=plugin)
        with writer:
            connections = {}
            for topic, message, stamp in self.messages:
                if topic not in connections:
                    connections[topic] = writer.add_connection(
                        topic, message.__msgtype__, typestore=self.types
                    )
                data = serialize(message, message.__msgtype__)
                writer.write(connections[topic], round(stamp * 1e9), data)
        if self.kind == "mcap file":
            (path,) = path.glob("*.mcap")
        return path


def png(image):
    return cv2.imencode(".png", image)[1].tobytes()
