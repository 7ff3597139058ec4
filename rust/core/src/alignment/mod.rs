//! Dense refinement of a verified homography on the grey values of a face.
//!
//! The reference is rendered into the frame by the start homography, as square tiles of frame pixels
//! with the frame's own resolution ([`template`]). Each tile then measures how far it is displaced in
//! the frame, by inverse compositional alignment (Lucas & Kanade, IJCAI 1981; Baker & Matthews, IJCV
//! 2004) with a gain and a bias of its own, eliminated in closed form ([`displacement`]). The
//! displacements, weighted by their information, determine the eight parameters of a small homography
//! of the frame robustly ([`motion`]): a hidden or shining tile is an outlier among the others.
//!
//! Tiles need no gradients of the frame and the rendering is made two or three times, so an iteration
//! costs little more than reading the frame at the tiles.

mod align;
mod area;
mod coarse;
mod config;
mod descent;
mod displacement;
mod footprint;
mod motion;
mod reference;
mod shift;
mod template;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests_afar;
mod tiles;
mod view;
mod workspace;

pub use align::{Alignment, align};
pub use coarse::{CoarseFrames, align_from_afar};
pub use config::AlignmentConfig;
pub use reference::AlignmentReference;
pub use view::apply;
pub use workspace::AlignmentWorkspace;
