//! What pose estimation gives.

use nalgebra::{Isometry3, Matrix6};

/// A pose with what is known of its quality.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseEstimate {
    /// Pose of the object in the camera's optical frame.
    pub T_camera_object: Isometry3<f64>,
    /// Of (translation [m], rotation vector [rad]) in the object's frame; `None` where the method
    /// does not give one.
    pub covariance: Option<Matrix6<f64>>,
    /// The part of it that differs from frame to frame: without what is unknown of the taught size
    /// and of the depth's scale, which all frames share.
    pub noise_covariance: Option<Matrix6<f64>>,
    /// Whether `alternative` explains the evidence about as well.
    pub ambiguous: bool,
    /// The other planar solution, where there is one.
    pub alternative: Option<Isometry3<f64>>,
    /// Of the inliers [px].
    pub reprojection_rms: f64,
    /// How many depth measurements took part.
    pub depth_pixels: usize,
}
