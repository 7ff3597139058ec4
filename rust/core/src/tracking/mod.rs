//! Following an object from frame to frame by the grey values of its faces.
//!
//! Where a pose is predicted to within some pixels, no features are needed: each face that it turns
//! towards the camera is aligned with its reference from there ([`crate::alignment`], on ever finer
//! images where the prediction is too far off), judged by what then agrees, and the pose follows from
//! all faces that are seen, with depth ([`crate::fused`]). What does not look like the object is
//! [`Lost`], with the reason.

mod config;
mod follow;
mod lost;
mod object;
mod sight;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;

pub use config::TrackingConfig;
pub use follow::{Followed, FollowedFace, follow, follow_each};
pub use lost::Lost;
pub use object::{TrackedFace, TrackedObject};
pub use sight::Sight;
