//! Arithmetic of planegrasp: the 6-DoF pose of flat faces from image correspondences and depth.
//!
//! Conventions, everywhere in this crate:
//! - SI units; depth in metres along the optical axis, 0 = no measurement.
//! - Camera frame: x right, y down, z forward. Face and object frames: x right, y up, z out of the
//!   face towards the viewer; a frontal, upright face has the rotation diag(1, -1, -1).
//! - `T_a_b` is the pose of frame b in frame a: p_a = T_a_b · p_b.
//! - Pixel centres lie at integer coordinates. "Pixel" means an undistorted pixel unless a name says
//!   "observed"; the normalised plane is z = 1 in the camera frame, without the lens.
//!
//! Three estimators: [`three_point::estimate`] (three depth look-ups, the baseline),
//! [`pnp::estimate`] (no depth) and [`fused::estimate`] (reprojection and depth together).

// Transforms are named by their two frames, T_camera_object, in code and documents alike.
#![allow(non_snake_case)]
// Units stand in brackets, [m], and are no links.
#![allow(rustdoc::broken_intra_doc_links)]

pub mod alignment;
mod bilinear;
pub mod budget;
pub mod camera;
pub mod candidates;
pub mod convex_hull;
pub mod correlation;
pub mod coverage;
pub mod depth_image;
pub mod depth_plane;
pub mod depth_region;
pub mod error;
pub mod estimate;
pub mod face;
pub mod face_search;
pub mod fused;
pub mod gray_image;
pub mod homography;
pub mod ippe;
pub mod keypoint;
pub mod lm;
pub mod matching;
#[cfg(test)]
mod numeric;
pub mod plane;
pub mod plane_consensus;
pub mod plane_observation;
pub mod pnp;
pub mod pose_filter;
pub mod pose_problem;
pub mod pose_state;
pub mod quadrilateral;
pub mod random;
pub mod rigid;
pub mod robust;
pub mod scale;
pub mod sift;
#[cfg(feature = "surf")]
pub mod surf;
#[cfg(test)]
mod synthetic;
pub mod three_point;
pub mod tracking;

pub use camera::Camera;
pub use depth_image::DepthImage;
pub use error::{InputError, PoseError};
pub use estimate::PoseEstimate;
pub use face::Face;
pub use gray_image::GrayImage;
pub use keypoint::Keypoint;
