//! What the refinement of a pose varies.

use nalgebra::Isometry3;

/// Pose (6) and scale disagreement (1).
pub const PARAMETERS: usize = 7;

/// Pose and nuisance.
#[derive(Debug, Clone)]
pub struct PoseState {
    /// Pose of the object in the camera frame, were the taught size exact.
    pub T_camera_object: Isometry3<f64>,
    /// Disagreement of depth with the taught size, z_measured = (1 + s)·z.
    pub disagreement: f64,
}

impl PoseState {
    /// A pose with which depth agrees.
    pub fn new(T_camera_object: Isometry3<f64>) -> Self {
        Self {
            T_camera_object,
            disagreement: 0.0,
        }
    }
}
