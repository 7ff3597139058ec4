//! From the matches of a frame to verified faces, and the reasons why others are not there (paper,
//! Algorithm 1: matches, RANSAC homography).
//!
//! For each face: matches that pass the ratio test, or support each other ([`support`]); a robust
//! homography refined over all matches that agree ([`estimate`]); then the checks whether it can be
//! a view of the face ([`plausible`]) and whether it looks like it ([`appearance`]). Faces are
//! independent of each other and searched in parallel.

mod aligned;
mod appearance;
mod estimate;
mod evidence;
mod face;
mod neighbourhood;
mod plausible;
mod refusal;
mod rigid_views;
#[cfg(test)]
mod scenes;
mod search;
mod settings;
mod support;

pub use appearance::Appearance;
pub use estimate::{HomographyEstimate, from_strict, from_supported, refine};
pub use evidence::{Evidence, FaceEvidence, ImageFeatures, Match};
pub use face::SearchedFace;
pub use refusal::Refusal;
pub use search::{Attempt, Figures, FoundFace, View, find, look_where};
pub use settings::SearchSettings;
