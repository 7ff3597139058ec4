//! Matching a frame's descriptors with those of all faces of all objects in one index.

mod candidates;
mod index;
mod reference;

pub use candidates::{Candidates, NONE};
pub use index::ReferenceIndex;
pub use reference::{Metric, ReferenceSet};
