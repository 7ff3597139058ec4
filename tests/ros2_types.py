"""Message types of rosbags, with vision_msgs, which it does not bring."""

from __future__ import annotations

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

# As in vision_msgs 4, that of ROS 2 Humble and later.
_VISION = {
    "ObjectHypothesis": "string class_id\nfloat64 score\n",
    "ObjectHypothesisWithPose": (
        "vision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n"
    ),
    "BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n",
    "Detection3D": (
        "std_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\n"
        "vision_msgs/BoundingBox3D bbox\nstring id\n"
    ),
    "Detection3DArray": "std_msgs/Header header\nvision_msgs/Detection3D[] detections\n",
}


def typestore(store=Stores.ROS2_HUMBLE):
    """The types of a distribution of ROS 2."""
    types = get_typestore(store)
    for name, text in _VISION.items():
        types.register(get_types_from_msg(text, f"vision_msgs/msg/{name}"))
    return types


def types_of(store):
    """A store as `MessageTypes`."""
    return lambda name: store.types[name]


def same(theirs, ours):
    """Whether two messages of different libraries have the same content, field by field."""
    if hasattr(theirs, "__msgtype__"):
        # Constants have capitals.
        names = [n for n in theirs.__dataclass_fields__ if n.islower() and n != "__msgtype__"]
        assert names == list(ours.__dataclass_fields__)
        return all(same(getattr(theirs, name), getattr(ours, name)) for name in names)
    if hasattr(theirs, "tolist"):
        return theirs.tolist() == list(ours)
    if isinstance(theirs, list):
        pairs = zip(theirs, ours, strict=True)
        return all(same(one, other) for one, other in pairs)
    return bool(theirs == ours)
