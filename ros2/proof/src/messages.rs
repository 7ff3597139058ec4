//! The messages, written down from ROS 2's definitions and not from planegrasp's.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::raw::{Bytes, Covariance};

/// A message on a topic.
pub trait Message: Serialize + DeserializeOwned + Clone + Send + 'static {
    /// Of its header, or of the first part that has one; 0 where there is none.
    fn stamp(&self) -> Time {
        Time::default()
    }

    fn set_stamp(&mut self, _stamp: Time) {}
}

macro_rules! messages {
    ($($(#[$about:meta])* $name:ident { $($field:ident: $kind:ty),* $(,)? })*) => {
        $(
            $(#[$about])*
            #[derive(Clone, Debug, Serialize, Deserialize)]
            #[serde(deny_unknown_fields)]
            pub struct $name { $(pub $field: $kind),* }
        )*
    };
}

macro_rules! stamped {
    ($($name:ident),*) => {
        $(
            impl Message for $name {
                fn stamp(&self) -> Time {
                    self.header.stamp
                }

                fn set_stamp(&mut self, stamp: Time) {
                    self.header.stamp = stamp;
                }
            }
        )*
    };
}

/// Do something with the type M that a name stands for.
macro_rules! with_type {
    ($name:expr, $kind:ident => $work:expr) => {
        with_type!(@ $name, $kind => $work;
            "diagnostic_msgs/msg/DiagnosticArray" DiagnosticArray,
            "geometry_msgs/msg/PoseStamped" PoseStamped,
            "geometry_msgs/msg/PoseWithCovarianceStamped" PoseWithCovarianceStamped,
            "sensor_msgs/msg/CameraInfo" CameraInfo,
            "sensor_msgs/msg/CompressedImage" CompressedImage,
            "sensor_msgs/msg/Image" Image,
            "std_msgs/msg/String" Text,
            "tf2_msgs/msg/TFMessage" TFMessage,
            "trajectory_msgs/msg/JointTrajectory" JointTrajectory,
            "vision_msgs/msg/Detection3DArray" Detection3DArray,
            "visualization_msgs/msg/MarkerArray" MarkerArray
        )
    };
    (@ $name:expr, $kind:ident => $work:expr; $($text:literal $message:ident),*) => {
        match $name {
            $($text => { type $kind = crate::messages::$message; $work })*
            other => Err(format!("{other:?} is no type of message that is known").into()),
        }
    };
}
pub(crate) use with_type;

/// builtin_interfaces/Time.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Time {
    pub sec: i32,
    pub nanosec: u32,
}

messages! {
    Duration { sec: i32, nanosec: u32 }
    Header { stamp: Time, frame_id: String }
    /// std_msgs/String.
    Text { data: String }
    ColorRGBA { r: f32, g: f32, b: f32, a: f32 }

    Point { x: f64, y: f64, z: f64 }
    Vector3 { x: f64, y: f64, z: f64 }
    Quaternion { x: f64, y: f64, z: f64, w: f64 }
    Pose { position: Point, orientation: Quaternion }
    PoseStamped { header: Header, pose: Pose }
    PoseWithCovariance { pose: Pose, covariance: Covariance }
    PoseWithCovarianceStamped { header: Header, pose: PoseWithCovariance }
    Transform { translation: Vector3, rotation: Quaternion }
    TransformStamped { header: Header, child_frame_id: String, transform: Transform }
    TFMessage { transforms: Vec<TransformStamped> }

    Image {
        header: Header,
        height: u32,
        width: u32,
        encoding: String,
        is_bigendian: u8,
        step: u32,
        data: Bytes,
    }
    CompressedImage { header: Header, format: String, data: Bytes }
    RegionOfInterest { x_offset: u32, y_offset: u32, height: u32, width: u32, do_rectify: bool }
    CameraInfo {
        header: Header,
        height: u32,
        width: u32,
        distortion_model: String,
        d: Vec<f64>,
        k: [f64; 9],
        r: [f64; 9],
        p: [f64; 12],
        binning_x: u32,
        binning_y: u32,
        roi: RegionOfInterest,
    }

    ObjectHypothesis { class_id: String, score: f64 }
    ObjectHypothesisWithPose { hypothesis: ObjectHypothesis, pose: PoseWithCovariance }
    BoundingBox3D { center: Pose, size: Vector3 }
    Detection3D {
        header: Header,
        results: Vec<ObjectHypothesisWithPose>,
        bbox: BoundingBox3D,
        id: String,
    }
    Detection3DArray { header: Header, detections: Vec<Detection3D> }

    UVCoordinate { u: f32, v: f32 }
    MeshFile { filename: String, data: Vec<u8> }
    Marker {
        header: Header,
        ns: String,
        id: i32,
        r#type: i32,
        action: i32,
        pose: Pose,
        scale: Vector3,
        color: ColorRGBA,
        lifetime: Duration,
        frame_locked: bool,
        points: Vec<Point>,
        colors: Vec<ColorRGBA>,
        texture_resource: String,
        texture: CompressedImage,
        uv_coordinates: Vec<UVCoordinate>,
        text: String,
        mesh_resource: String,
        mesh_file: MeshFile,
        mesh_use_embedded_materials: bool,
    }
    MarkerArray { markers: Vec<Marker> }

    JointTrajectoryPoint {
        positions: Vec<f64>,
        velocities: Vec<f64>,
        accelerations: Vec<f64>,
        effort: Vec<f64>,
        time_from_start: Duration,
    }
    JointTrajectory { header: Header, joint_names: Vec<String>, points: Vec<JointTrajectoryPoint> }

    KeyValue { key: String, value: String }
    DiagnosticStatus {
        level: u8,
        name: String,
        message: String,
        hardware_id: String,
        values: Vec<KeyValue>,
    }
    DiagnosticArray { header: Header, status: Vec<DiagnosticStatus> }
}

stamped!(
    CameraInfo,
    CompressedImage,
    Detection3DArray,
    DiagnosticArray,
    Image,
    JointTrajectory,
    PoseStamped,
    PoseWithCovarianceStamped
);

impl Message for Text {}

impl Message for TFMessage {
    fn stamp(&self) -> Time {
        self.transforms
            .first()
            .map_or(Time::default(), |one| one.header.stamp)
    }
}

impl Message for MarkerArray {
    fn stamp(&self) -> Time {
        self.markers
            .first()
            .map_or(Time::default(), |one| one.header.stamp)
    }
}
