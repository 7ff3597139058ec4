//! Why a face is not there.

use thiserror::Error;

/// Why the search of one face ended without finding it.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Refusal {
    /// Nothing to be found by.
    #[error("the reference image has no features")]
    NoFeatures,
    /// Too few matches pass the ratio test.
    #[error("{matches} matches (at least {needed})")]
    TooFewMatches {
        /// Matches that pass.
        matches: usize,
        /// How many there must be.
        needed: usize,
    },
    /// The robust estimation found nothing.
    #[error("no homography explains any four of its {matches} matches")]
    NoHomography {
        /// Matches that pass the ratio test.
        matches: usize,
    },
    /// The homography found explains too few matches.
    #[error("{inliers} inliers (at least {needed})")]
    TooFewInliers {
        /// Matches that it explains.
        inliers: usize,
        /// How many there must be.
        needed: usize,
    },
    /// The horizon cuts through the face.
    #[error("part of the face would lie behind the camera")]
    BehindCamera,
    /// Turned inside out.
    #[error("the outline is mirrored: the face would be seen from behind")]
    Mirrored,
    /// Crossed or dented.
    #[error("the outline is not a convex quadrilateral")]
    NotConvex,
    /// Too small to be sure of.
    #[error("the outline is {side:.1} px short (at least {least} px)")]
    ShortSide {
        /// The shortest side [px].
        side: f64,
        /// How long it must be [px].
        least: f64,
    },
    /// Nothing of it in the image.
    #[error("the outline lies outside of the image")]
    OutsideImage,
    /// Not the taught aspect ratio, or skewed.
    #[error(
        "no rigid view of a face of this width and height: stretched by {stretch:.2} \
         (at most {most})"
    )]
    Stretched {
        /// By which factor.
        stretch: f64,
        /// What is allowed.
        most: f64,
    },
    /// The inliers lie close together.
    #[error(
        "inliers cover {:.0}% of the face (at least {:.0}%)",
        100.0 * coverage, 100.0 * least
    )]
    Coverage {
        /// Share of the face.
        coverage: f64,
        /// What is needed.
        least: f64,
    },
    /// It does not look like the reference.
    #[error(
        "{:.0}% of the face looks like its reference (at least {:.0}%)",
        100.0 * agreement, 100.0 * least
    )]
    Agreement {
        /// Share of its textured cells.
        agreement: f64,
        /// What is needed.
        least: f64,
    },
}

impl Refusal {
    /// The stage that refused: "features", "matching", "homography" or "verification".
    pub fn stage(&self) -> &'static str {
        match self {
            Self::NoFeatures => "features",
            Self::TooFewMatches { .. } => "matching",
            Self::NoHomography { .. } => "homography",
            _ => "verification",
        }
    }
}
