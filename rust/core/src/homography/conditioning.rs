//! Coordinates in which homographies are well conditioned (Hartley, PAMI 1997).

use nalgebra::{Matrix3, Vector2};

use super::PointMatch;

/// Similarities that move both sides of all matches to the origin and to unit size.
#[derive(Debug, Clone)]
pub struct Conditioning {
    source: Similarity,
    target: Similarity,
}

#[derive(Debug, Clone)]
struct Similarity {
    centre: Vector2<f64>,
    scale: f64,
}

impl Conditioning {
    /// `None` where one side is a single point, or not finite.
    pub fn of(matches: &[PointMatch]) -> Option<Self> {
        Some(Self {
            source: Similarity::of(matches.iter().map(|point| point.source))?,
            target: Similarity::of(matches.iter().map(|point| point.target))?,
        })
    }

    /// A match in conditioned coordinates.
    pub fn condition(&self, point: &PointMatch) -> PointMatch {
        PointMatch {
            source: self.source.apply(point.source),
            target: self.target.apply(point.target),
        }
    }

    /// A length in the target, in conditioned coordinates.
    pub fn target_length(&self, length: f64) -> f64 {
        length * self.target.scale
    }

    /// From the source to its conditioned coordinates.
    pub fn source_matrix(&self) -> Matrix3<f64> {
        self.source.matrix()
    }

    /// From the target to its conditioned coordinates.
    pub fn target_matrix(&self) -> Matrix3<f64> {
        self.target.matrix()
    }

    /// A homography between original coordinates, between conditioned ones.
    pub fn conditioned(&self, H: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        Some(self.target.matrix() * H * self.source.matrix().try_inverse()?)
    }

    /// The inverse of `conditioned`.
    pub fn original(&self, H: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        Some(self.target.matrix().try_inverse()? * H * self.source.matrix())
    }
}

impl Similarity {
    fn of(points: impl Iterator<Item = Vector2<f64>> + Clone) -> Option<Self> {
        let count = points.clone().count().max(1) as f64;
        let centre = points.clone().sum::<Vector2<f64>>() / count;
        let spread = points.map(|p| (p - centre).norm()).sum::<f64>() / count;
        let scale = std::f64::consts::SQRT_2 / spread;
        (scale.is_finite() && scale > 0.0).then_some(Self { centre, scale })
    }

    fn apply(&self, point: Vector2<f64>) -> Vector2<f64> {
        (point - self.centre) * self.scale
    }

    fn matrix(&self) -> Matrix3<f64> {
        let shift = -self.centre * self.scale;
        Matrix3::new(
            self.scale, 0.0, shift.x, 0.0, self.scale, shift.y, 0.0, 0.0, 1.0,
        )
    }
}
