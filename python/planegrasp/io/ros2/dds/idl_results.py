"""Messages of vision_msgs and visualization_msgs as DDS types."""

# No `from __future__ import annotations`: cyclonedds reads the annotations when a class is made.

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import float32, float64, int32, sequence, uint8

from planegrasp.io.ros2.dds.idl_common import (
    ColorRGBA,
    Duration,
    Header,
    Point,
    Pose,
    PoseWithCovariance,
    Vector3,
    numbers,
)
from planegrasp.io.ros2.dds.idl_images import CompressedImage


@dataclass
@final
class ObjectHypothesis(IdlStruct, typename="vision_msgs::msg::dds_::ObjectHypothesis_"):
    """vision_msgs/ObjectHypothesis."""

    class_id: str
    score: float64


@dataclass
@final
class ObjectHypothesisWithPose(
    IdlStruct, typename="vision_msgs::msg::dds_::ObjectHypothesisWithPose_"
):
    """vision_msgs/ObjectHypothesisWithPose."""

    hypothesis: ObjectHypothesis
    pose: PoseWithCovariance


@dataclass
@final
class BoundingBox3D(IdlStruct, typename="vision_msgs::msg::dds_::BoundingBox3D_"):
    """vision_msgs/BoundingBox3D."""

    center: Pose
    size: Vector3


@dataclass
@final
class Detection3D(IdlStruct, typename="vision_msgs::msg::dds_::Detection3D_"):
    """vision_msgs/Detection3D, as in ROS 2 Humble and later."""

    header: Header
    results: sequence[ObjectHypothesisWithPose]
    bbox: BoundingBox3D
    id: str


@dataclass
@final
class Detection3DArray(IdlStruct, typename="vision_msgs::msg::dds_::Detection3DArray_"):
    """vision_msgs/Detection3DArray."""

    header: Header
    detections: sequence[Detection3D]


@dataclass
@final
class UVCoordinate(IdlStruct, typename="visualization_msgs::msg::dds_::UVCoordinate_"):
    """visualization_msgs/UVCoordinate."""

    u: float32
    v: float32


@dataclass
@final
class MeshFile(IdlStruct, typename="visualization_msgs::msg::dds_::MeshFile_"):
    """visualization_msgs/MeshFile."""

    filename: str
    data: sequence[uint8]

    def __post_init__(self) -> None:
        self.data = numbers(self.data)


@dataclass
@final
class Marker(IdlStruct, typename="visualization_msgs::msg::dds_::Marker_"):
    """visualization_msgs/Marker, as in ROS 2 Humble and later."""

    header: Header
    ns: str
    id: int32
    type: int32
    action: int32
    pose: Pose
    scale: Vector3
    color: ColorRGBA
    lifetime: Duration
    frame_locked: bool
    points: sequence[Point]
    colors: sequence[ColorRGBA]
    texture_resource: str
    texture: CompressedImage
    uv_coordinates: sequence[UVCoordinate]
    text: str
    mesh_resource: str
    mesh_file: MeshFile
    mesh_use_embedded_materials: bool


@dataclass
@final
class MarkerArray(IdlStruct, typename="visualization_msgs::msg::dds_::MarkerArray_"):
    """visualization_msgs/MarkerArray."""

    markers: sequence[Marker]
