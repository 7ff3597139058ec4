//! Settings of the search.

/// Settings of estimation and verification; `planegrasp.homography.HomographyConfig` has the
/// defaults and says why.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchSettings {
    /// Fewer matches than this are no candidate.
    pub min_matches: usize,
    /// Of the ratio test.
    pub max_ratio: f64,
    /// Of matches that count only where they support each other.
    pub max_loose_ratio: f64,
    /// Largest reprojection error of an inlier [px].
    pub threshold: f64,
    /// At most this many RANSAC samples.
    pub iterations: usize,
    /// An accepted face has at least this many.
    pub min_inliers: usize,
    /// Convex hull of the inliers over the area of the face, at least.
    pub min_coverage: f64,
    /// Shortest side of the outline [px], at least.
    pub min_side: f64,
    /// How far lengths along x and y of the face may disagree with its aspect ratio, as a factor.
    pub max_stretch: f64,
    /// Relative standard deviation of the taught aspect ratio.
    pub aspect_sigma: f64,
    /// Share of the face's textured cells that look like the reference, at least.
    pub min_agreement: f64,
    /// Share of the aligned tiles that agree, at least, for a face without inliers; in proportion
    /// less with more of them, nothing with 60 that are well spread, nor where the tiles that agree
    /// leave no doubt.
    pub min_doubtful_tiles: f64,
}
