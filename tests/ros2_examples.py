"""One message of each type that is published or read, with values in every field."""

from __future__ import annotations

import numpy as np

from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.io.messages import (
    Box,
    DetectedObject,
    DetectionsMessage,
    GraspPlanMessage,
    GraspRefusalMessage,
    GraspVerdict,
    Header,
    Pose,
    PoseWithCovariance,
    Stamp,
    TrackedObject,
    TracksMessage,
    TwistWithCovariance,
)
from planegrasp.io.ros2.conversions import (
    camera_info_message,
    detection3d_array,
    image_message,
    pose_stamped,
    tf_message,
)
from planegrasp.io.ros2.grasp_conversions import grasp_pose, joint_trajectory, verdicts_array
from planegrasp.io.ros2.markers import marker_array

HEADER = Header(Stamp(1_700_000_000, 123_456_789), "camera_color_optical_frame")
CAMERA = PinholeCamera(7, 5, 8.0, 8.5, 3.0, 2.0, (0.1, -0.2, 0.01, 0.02, 0.3))


def pose(seed):
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.normal(size=3))
    return Pose.of(RigidTransform.from_components(rng.normal(size=3), turn))


def covariance(seed):
    root = np.random.default_rng(seed).normal(size=(6, 6))
    return tuple((root @ root.T).ravel().tolist())


def detections():
    box = Box((0.0, 0.01, -0.02), (0.2, 0.3, 0.04))
    corners = ((1.0, 2.0), (3.0, 2.0), (3.0, 4.0), (1.0, 4.0))
    known = PoseWithCovariance(pose(1), covariance(1))
    one = DetectedObject("book", 0, 7, True, 0.9, 50, corners, box, known, None, "")
    unsure = PoseWithCovariance(pose(2), None)
    two = DetectedObject("box", 1, None, False, 0.5, 12, corners, box, unsure, pose(3), "")
    none = DetectedObject("bag", 0, None, False, 0.4, 11, corners, box, None, None, "no depth")
    return DetectionsMessage(HEADER, (one, two, none))


def tracks():
    twist = TwistWithCovariance((0.1, 0.2, 0.3), (1.0, 2.0, 3.0), covariance(4))
    box = Box((0.0, 0.01, -0.02), (0.2, 0.3, 0.04))
    known = PoseWithCovariance(pose(4), covariance(5))
    seen = TrackedObject(7, "book", 2, True, "", 0.5, box, known, twist)
    hidden = TrackedObject(8, "box", 0, False, "covered", 0.5, box, known, twist)
    return TracksMessage(HEADER, (seen, hidden), lost=(3,))


def plan():
    chosen = GraspVerdict("side", True, "", 0.8, (("clearance", 0.01), ("limit_margin", 1 / 3)))
    other = GraspVerdict("top", False, "out of reach by 0.2 m", 0.0, ())
    return GraspPlanMessage(
        header=Header(HEADER.stamp, "base_link"),
        name="bücher",
        grasp="side",
        object_pose=pose(6),
        gripper_pose=pose(7),
        pregrasp_pose=pose(8),
        opening=0.06,
        force=40.0,
        joints=("shoulder", "elbow"),
        move=((0.0, 1.0), (0.1, 1 / 3), (0.5, 1.5)),
        reach=((0.5, 1.5), (0.6, 1.25)),
        lift=((0.6, 1.25), (0.7, 1.0)),
        verdicts=(chosen, other),
    )


def refusal():
    refused = GraspVerdict("side", False, "out of reach by 0.2 m", 0.0, (("position_error", 0.2),))
    return GraspRefusalMessage(HEADER, "bücher", "no grasp can be done", (refused,))


def messages(types):
    """By type: one message of each, made of these types."""
    rng = np.random.default_rng(0)
    millimetres = rng.integers(0, 5000, (5, 7), np.uint16)
    known = PoseWithCovariance(pose(1), covariance(1))
    image = image_message(types, HEADER, millimetres, "16UC1")
    return {
        "vision_msgs/msg/Detection3DArray": detection3d_array(types, detections()),
        "geometry_msgs/msg/PoseWithCovarianceStamped": pose_stamped(types, HEADER, known),
        "tf2_msgs/msg/TFMessage": tf_message(
            types, [(HEADER, "objects/book", pose(1)), (HEADER, "objects/box/1", pose(2))]
        ),
        "visualization_msgs/msg/MarkerArray": marker_array(types, tracks()),
        "sensor_msgs/msg/Image": image,
        "sensor_msgs/msg/CompressedImage": types("sensor_msgs/msg/CompressedImage")(
            header=image.header, format="png", data=np.frombuffer(b"\x89PNG", np.uint8)
        ),
        "sensor_msgs/msg/CameraInfo": camera_info_message(types, HEADER, CAMERA),
        "trajectory_msgs/msg/JointTrajectory": joint_trajectory(
            types, HEADER, plan().joints, plan().move
        ),
        "geometry_msgs/msg/PoseStamped": grasp_pose(types, HEADER, pose(1)),
        "diagnostic_msgs/msg/DiagnosticArray": verdicts_array(types, plan()),
        "std_msgs/msg/String": types("std_msgs/msg/String")(data='{"priorities": {"bücher": 1}}'),
    }
