//! Robust homographies from point matches of graded quality.
//!
//! [`estimate`] samples progressively, the likelier matches first (PROSAC: Chum & Matas, CVPR 2005),
//! solves four points in closed form ([`minimal`]), scores by truncated squared errors (MSAC: Torr
//! & Zisserman, CVIU 2000) and refines each new best on all matches (local optimisation: Chum,
//! Matas & Kittler, DAGM 2003) by Levenberg-Marquardt under Cauchy's loss ([`refine`]).

mod conditioning;
mod minimal;
mod progressive;
mod ransac;
mod refine;
mod rigidity;
mod sums;

pub use ransac::{RansacConfig, RobustHomography, estimate};
pub use refine::{Prior, refine};
pub use rigidity::Rigidity;

use nalgebra::{Matrix3, Vector2};

/// One match: where a point lies in the source and in the target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMatch {
    /// In the source, for example the reference image.
    pub source: Vector2<f64>,
    /// In the target, for example undistorted pixels of a frame.
    pub target: Vector2<f64>,
}

impl PointMatch {
    /// Squared distance between the mapped source and the target; infinite behind the camera.
    pub fn squared_error(&self, H: &Matrix3<f64>) -> f64 {
        let mapped = H * self.source.push(1.0);
        if mapped.z <= 0.0 {
            return f64::INFINITY;
        }
        (mapped.xy() / mapped.z - self.target).norm_squared()
    }
}
