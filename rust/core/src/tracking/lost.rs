//! Why an object is not where it was predicted.

use thiserror::Error;

use crate::PoseError;

/// Why an object, or one face of it, could not be followed into a frame.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Lost {
    /// Seen from behind or nearly edge on.
    #[error("no face is turned towards the camera")]
    TurnedAway,
    /// Too small to be sure of.
    #[error("the outline is {side:.1} px short (at least {least} px)")]
    TooSmall {
        /// The shortest side [px].
        side: f64,
        /// How long it must be [px].
        least: f64,
    },
    /// Little or nothing of its texture lies in the image.
    #[error("{tiles} textured tiles lie in the image (at least {least})")]
    OutsideImage {
        /// How many do.
        tiles: usize,
        /// How many must.
        least: usize,
    },
    /// What is seen there is something else.
    #[error("{tiles} of {compared} tiles look like the reference (at least {least})")]
    Unlike {
        /// Tiles that agree with the reference.
        tiles: usize,
        /// Of so many that lie in the image.
        compared: usize,
        /// How many must agree.
        least: usize,
    },
    /// The tiles that agree do so badly.
    #[error("what is seen correlates {score:.2} with the reference (at least {least:.2})")]
    Faint {
        /// Mean correlation.
        score: f64,
        /// What is needed.
        least: f64,
    },
    /// No rigid face can look so.
    #[error("the aligned outline is stretched by {stretch:.2} (at most {most:.2})")]
    Bent {
        /// By which factor.
        stretch: f64,
        /// What is allowed.
        most: f64,
    },
    /// Seen, but without a pose.
    #[error(transparent)]
    Pose(#[from] PoseError),
}
