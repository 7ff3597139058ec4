//! An error-state Kalman filter for the pose and velocity of something that moves smoothly.
//!
//! The state is a rigid pose in a fixed frame with a linear and an angular velocity, all constant but
//! for a white acceleration. Its uncertainty lives in the tangent space: twelve errors (translation,
//! rotation, linear velocity, angular velocity) along the axes of the fixed frame (Solà, *Quaternion
//! kinematics for the error-state Kalman filter*, 2017, with global angular errors).
//!
//! [`modes`] runs two of them side by side, for what stands still and moves by turns.

mod config;
pub mod modes;
mod state;

pub use config::PoseFilterConfig;
pub use state::{ERRORS, FilteredPose, Measurement};
