"""The message model as ROS messages, whatever library makes the classes of these.

rclpy, rosbags and the DDS types of `planegrasp.io.ros2` all have classes that take the members of a
message by name. `MessageTypes` gives these classes by the name of the message; everything here is
written against that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planegrasp.io.messages.pose import Pose, PoseWithCovariance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from planegrasp.geometry import PinholeCamera
    from planegrasp.io.messages.header import Header
    from planegrasp.io.messages.objects import DetectedObject, DetectionsMessage, TrackedObject
    from planegrasp.io.ros2.transport import MessageTypes

__all__ = [
    "UNKNOWN_COVARIANCE",
    "camera_info_message",
    "detection3d_array",
    "header_message",
    "image_message",
    "pose_message",
    "pose_stamped",
    "tf_message",
]

UNKNOWN_COVARIANCE = (-1.0, *[0.0] * 35)
"""What a pose without covariance has: no covariance begins with -1 (the rule of sensor_msgs)."""


def header_message(types: MessageTypes, header: Header) -> Any:
    """std_msgs/Header."""
    stamp = types("builtin_interfaces/msg/Time")(
        sec=header.stamp.seconds, nanosec=header.stamp.nanoseconds
    )
    return types("std_msgs/msg/Header")(stamp=stamp, frame_id=header.frame_id)


def pose_message(types: MessageTypes, pose: Pose) -> Any:
    """geometry_msgs/Pose."""
    return types("geometry_msgs/msg/Pose")(
        position=xyz(types, "Point", pose.position), orientation=_quaternion(types, pose)
    )


def xyz(types: MessageTypes, kind: str, values: Sequence[float]) -> Any:
    """Point or Vector3 of geometry_msgs."""
    x, y, z = (float(value) for value in values)
    return types(f"geometry_msgs/msg/{kind}")(x=x, y=y, z=z)


def pose_stamped(types: MessageTypes, header: Header, pose: PoseWithCovariance) -> Any:
    """geometry_msgs/PoseWithCovarianceStamped."""
    return types("geometry_msgs/msg/PoseWithCovarianceStamped")(
        header=header_message(types, header), pose=_with_covariance(types, pose)
    )


def detection3d_array(types: MessageTypes, message: DetectionsMessage) -> Any:
    """vision_msgs/Detection3DArray of the objects that have a pose.

    The hypothesis is the object by name with its score. Where a second pose explains the image
    about as well, it follows as a second hypothesis of the same name. `id` is the track's number,
    "" where the object is not followed.
    """
    header = header_message(types, message.header)
    return types("vision_msgs/msg/Detection3DArray")(
        header=header,
        detections=[_detection(types, header, one) for one in message.objects if one.pose],
    )


def tf_message(types: MessageTypes, transforms: Sequence[tuple[Header, str, Pose]]) -> Any:
    """tf2_msgs/TFMessage.

    Args:
        types: of messages.
        transforms: header with the parent's frame, name of the child's frame, and its pose.
    """
    one = types("geometry_msgs/msg/TransformStamped")
    return types("tf2_msgs/msg/TFMessage")(
        transforms=[
            one(
                header=header_message(types, header),
                child_frame_id=child,
                transform=types("geometry_msgs/msg/Transform")(
                    translation=xyz(types, "Vector3", pose.position),
                    rotation=_quaternion(types, pose),
                ),
            )
            for header, child, pose in transforms
        ]
    )


def image_message(types: MessageTypes, header: Header, pixels: NDArray[Any], encoding: str) -> Any:
    """sensor_msgs/Image, little-endian.

    Args:
        types: of messages.
        header: of the image.
        pixels: H×W or H×W×channels.
        encoding: for example ``rgb8``, ``16UC1``, ``32FC1``; it must fit the pixels' type.
    """
    height, width = pixels.shape[:2]
    little = np.ascontiguousarray(pixels, dtype=pixels.dtype.newbyteorder("<"))
    return types("sensor_msgs/msg/Image")(
        header=header_message(types, header),
        height=height,
        width=width,
        encoding=encoding,
        is_bigendian=0,
        step=little.strides[0],
        data=little.reshape(-1).view(np.uint8),
    )


def camera_info_message(types: MessageTypes, header: Header, camera: PinholeCamera) -> Any:
    """sensor_msgs/CameraInfo of an image that is not rectified."""
    P = np.zeros((3, 4))
    P[:, :3] = camera.matrix
    whole = types("sensor_msgs/msg/RegionOfInterest")(
        x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
    )
    return types("sensor_msgs/msg/CameraInfo")(
        header=header_message(types, header),
        height=camera.height,
        width=camera.width,
        distortion_model="plumb_bob",
        d=camera.coefficients,
        k=camera.matrix.ravel(),
        r=np.eye(3).ravel(),
        p=P.ravel(),
        binning_x=0,
        binning_y=0,
        roi=whole,
    )


def box_pose(pose: Pose, detected: DetectedObject | TrackedObject) -> Pose:
    """Pose of the centre of an object's box, given the object's."""
    return Pose(pose.apply(detected.box.centre), pose.orientation)


def _detection(types: MessageTypes, header: Any, detected: DetectedObject) -> Any:
    assert detected.pose is not None
    poses = [detected.pose]
    if detected.alternative is not None:
        poses.append(PoseWithCovariance(detected.alternative, None))
    hypothesis = types("vision_msgs/msg/ObjectHypothesis")
    box = types("vision_msgs/msg/BoundingBox3D")(
        center=pose_message(types, box_pose(detected.pose.pose, detected)),
        size=xyz(types, "Vector3", detected.box.size),
    )
    return types("vision_msgs/msg/Detection3D")(
        header=header,
        results=[
            types("vision_msgs/msg/ObjectHypothesisWithPose")(
                hypothesis=hypothesis(class_id=detected.name, score=detected.score),
                pose=_with_covariance(types, pose),
            )
            for pose in poses
        ],
        bbox=box,
        id="" if detected.track is None else str(detected.track),
    )


def _with_covariance(types: MessageTypes, pose: PoseWithCovariance) -> Any:
    covariance = UNKNOWN_COVARIANCE if pose.covariance is None else pose.covariance
    return types("geometry_msgs/msg/PoseWithCovariance")(
        pose=pose_message(types, pose.pose), covariance=np.array(covariance)
    )


def _quaternion(types: MessageTypes, pose: Pose) -> Any:
    x, y, z, w = pose.orientation
    return types("geometry_msgs/msg/Quaternion")(x=x, y=y, z=z, w=w)
