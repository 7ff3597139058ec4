//! Matching a frame's descriptors with those of all faces of all objects in one index.
//!
//! Descriptors are bytes, distances are exact integers: whichever instruction set computes them and
//! however many threads do, the neighbours are the same.

mod blocks;
mod candidates;
mod exhaustive;
mod index;
mod kernel;
mod nearest;
mod numbers;
#[cfg(test)]
mod oracle;
mod proposal;
mod queries;
mod query_keypoint;
mod reference;
mod scan;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;

pub use candidates::{Candidates, NONE};
pub use index::ReferenceIndex;
pub use kernel::Kernel;
pub use proposal::ProposalSettings;
pub use queries::Queries;
pub use query_keypoint::QueryKeypoint;
pub use reference::{MOST_FILED, Metric, ReferenceSet};
