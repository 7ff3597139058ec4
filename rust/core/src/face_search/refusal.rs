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
    #[error("no rigid view of the face explains four of its {matches} matches")]
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
    /// The grey values of the face do not bear out the few or clustered matches that led to it.
    #[error(
        "inliers are few or close together, and {:.0}% of the aligned tiles agree with the reference \
         (at least {:.0}%)",
        100.0 * tiles, 100.0 * least
    )]
    Tiles {
        /// Share of the tiles.
        tiles: f64,
        /// What is needed with so many inliers, spread so far.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_quote_what_was_found_and_what_is_needed() {
        let cases = [
            (
                Refusal::NoFeatures,
                "features",
                "the reference image has no features",
            ),
            (
                Refusal::TooFewMatches {
                    matches: 3,
                    needed: 10,
                },
                "matching",
                "3 matches (at least 10)",
            ),
            (
                Refusal::NoHomography { matches: 12 },
                "homography",
                "no rigid view of the face explains four of its 12 matches",
            ),
            (
                Refusal::TooFewInliers {
                    inliers: 5,
                    needed: 8,
                },
                "verification",
                "5 inliers (at least 8)",
            ),
            (
                Refusal::BehindCamera,
                "verification",
                "part of the face would lie behind the camera",
            ),
            (
                Refusal::Mirrored,
                "verification",
                "the outline is mirrored: the face would be seen from behind",
            ),
            (
                Refusal::NotConvex,
                "verification",
                "the outline is not a convex quadrilateral",
            ),
            (
                Refusal::ShortSide {
                    side: 2.96,
                    least: 8.0,
                },
                "verification",
                "the outline is 3.0 px short (at least 8 px)",
            ),
            (
                Refusal::OutsideImage,
                "verification",
                "the outline lies outside of the image",
            ),
            (
                Refusal::Stretched {
                    stretch: 2.5,
                    most: 1.6,
                },
                "verification",
                "no rigid view of a face of this width and height: stretched by 2.50 (at most 1.6)",
            ),
            (
                Refusal::Coverage {
                    coverage: 0.014,
                    least: 0.03,
                },
                "verification",
                "inliers cover 1% of the face (at least 3%)",
            ),
            (
                Refusal::Agreement {
                    agreement: 0.124,
                    least: 0.3,
                },
                "verification",
                "12% of the face looks like its reference (at least 30%)",
            ),
            (
                Refusal::Tiles {
                    tiles: 0.131,
                    least: 0.422,
                },
                "verification",
                "inliers are few or close together, and 13% of the aligned tiles agree with the \
                 reference (at least 42%)",
            ),
        ];
        for (refusal, stage, reason) in cases {
            assert_eq!(refusal.to_string(), reason);
            assert_eq!(refusal.stage(), stage);
        }
    }
}
