//! What is known of a homography between a flat rigid thing and a calibrated camera.
//!
//! For H = K · (r₁ r₂ t) · S, with S from the source to metres on the thing, the first two columns of
//! K⁻¹ · H · S⁻¹ are proportional to r₁ and r₂: equally long and orthogonal (Zhang, PAMI 2000). Eight
//! free parameters ignore this, and few matches on a small part of an oblique face leave the rest of
//! it badly determined.

use nalgebra::{Matrix3, SMatrix, Vector2};

use super::conditioning::Conditioning;

/// The two constraints, between any coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Rigidity {
    /// K⁻¹, from the target to the normalised plane.
    normalised_from_target: Matrix3<f64>,
    /// S⁻¹, from metres to the source.
    source_from_metric: Matrix3<f64>,
}

impl Rigidity {
    /// Of a camera (K⁻¹) and of a source that `metric_from_source` maps to metres; `None` where that
    /// has no inverse.
    pub fn new(
        normalised_from_target: Matrix3<f64>,
        metric_from_source: &Matrix3<f64>,
    ) -> Option<Self> {
        Some(Self {
            normalised_from_target,
            source_from_metric: metric_from_source.try_inverse()?,
        })
    }

    /// The same between conditioned coordinates.
    pub fn conditioned(&self, conditioning: &Conditioning) -> Option<Self> {
        // K⁻¹ · H · S⁻¹ = K⁻¹ · (T⁻¹ · H' · U) · S⁻¹ for the conditioned H' = T · H · U⁻¹.
        let target = conditioning.target_matrix().try_inverse()?;
        Some(Self {
            normalised_from_target: self.normalised_from_target * target,
            source_from_metric: conditioning.source_matrix() * self.source_from_metric,
        })
    }

    /// By which factor, ≥ 1, a homography departs from a rigid view: the ratio of the singular
    /// values of what should be (r₁ r₂).
    pub fn stretch(&self, H: &Matrix3<f64>) -> f64 {
        let metric = self.normalised_from_target * H * self.source_from_metric;
        let (a, b) = (metric.column(0), metric.column(1));
        // Eigenvalues of the 2×2 Gram matrix are the squared singular values.
        let (aa, ab, bb) = (a.dot(&a), a.dot(&b), b.dot(&b));
        let (mean, half) = ((aa + bb) / 2.0, ((aa - bb) / 2.0).hypot(ab));
        ((mean + half) / (mean - half).max(f64::MIN_POSITIVE)).sqrt()
    }

    /// Logarithm of the ratio of the lengths, and the cosine between the columns: 0 for a rigid
    /// view. Also their derivatives by the first eight entries of H, row by row.
    pub fn residuals(&self, H: &Matrix3<f64>) -> (Vector2<f64>, SMatrix<f64, 2, 8>) {
        let before = &self.normalised_from_target;
        let metric = before * H * self.source_from_metric;
        let (a, b) = (metric.column(0), metric.column(1));
        let (aa, bb) = (a.norm_squared(), b.norm_squared());
        let norms = (aa * bb).sqrt();
        let cosine = a.dot(&b) / norms;
        let mut jacobian = SMatrix::zeros();
        for entry in 0..8 {
            let (i, j) = (entry / 3, entry % 3);
            let da = before.column(i) * self.source_from_metric[(j, 0)];
            let db = before.column(i) * self.source_from_metric[(j, 1)];
            let (along_a, along_b) = (a.dot(&da) / aa, b.dot(&db) / bb);
            jacobian[(0, entry)] = along_a - along_b;
            jacobian[(1, entry)] = (da.dot(&b) + a.dot(&db)) / norms - cosine * (along_a + along_b);
        }
        (Vector2::new(0.5 * (aa / bb).ln(), cosine), jacobian)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;
    use crate::numeric::assert_jacobian;

    const K: Matrix3<f64> = Matrix3::new(525.0, 0.0, 319.5, 0.0, 530.0, 239.5, 0.0, 0.0, 1.0);
    const S: Matrix3<f64> = Matrix3::new(5e-4, 0.0, -0.1, 0.0, -5e-4, 0.075, 0.0, 0.0, 1.0);

    fn rigidity() -> Rigidity {
        Rigidity::new(K.try_inverse().unwrap(), &S).unwrap()
    }

    fn view() -> Matrix3<f64> {
        let R = Rotation3::from_euler_angles(0.4, -0.9, 0.3).into_inner();
        let t = Vector3::new(0.05, -0.02, 0.7);
        let H = K * Matrix3::from_columns(&[R.column(0).into(), R.column(1).into(), t]) * S;
        H / H[(2, 2)]
    }

    #[test]
    fn a_rigid_view_has_no_residuals() {
        let (residuals, _) = rigidity().residuals(&view());
        assert!(residuals.norm() < 1e-12, "{residuals}");
        assert!((rigidity().stretch(&view()) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_wrong_aspect_ratio_is_one_residual_and_skew_the_other() {
        let centre = Matrix3::new_translation(&Vector2::new(-200.0, -150.0));
        let about_centre = |A: Matrix3<f64>| view() * centre.try_inverse().unwrap() * A * centre;
        let longer = about_centre(Matrix3::new_nonuniform_scaling(&Vector2::new(1.2, 1.0)));
        let (residuals, _) = rigidity().residuals(&longer);
        assert!((residuals.x - 1.2_f64.ln()).abs() < 1e-12 && residuals.y.abs() < 1e-12);
        assert!((rigidity().stretch(&longer) - 1.2).abs() < 1e-9);
        let mut shear = Matrix3::identity();
        shear[(0, 1)] = 0.3;
        let (residuals, _) = rigidity().residuals(&about_centre(shear));
        assert!((residuals.y.abs() - 0.3 / 1.09_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn the_jacobian_is_the_derivative() {
        // Of unit size, as conditioned coordinates are.
        let rigidity = Rigidity::new(
            Matrix3::new(0.9, 0.0, 0.1, 0.0, 1.1, -0.2, 0.0, 0.0, 1.0),
            &Matrix3::new(0.7, 0.1, 0.0, -0.1, 0.8, 0.3, 0.0, 0.0, 1.0),
        );
        let rigidity = rigidity.unwrap();
        let H = Matrix3::new(0.9, 0.2, 0.1, -0.3, 1.2, 0.2, 0.15, -0.4, 1.0);
        let entries: [f64; 8] = std::array::from_fn(|i| H[(i / 3, i % 3)]);
        let map = |h: &[f64; 8]| {
            let mut moved = H;
            for (i, value) in h.iter().enumerate() {
                moved[(i / 3, i % 3)] = *value;
            }
            rigidity.residuals(&moved).0.into()
        };
        assert_jacobian(map, &entries, rigidity.residuals(&H).1);
    }

    #[test]
    fn conditioned_coordinates_change_nothing() {
        use crate::homography::PointMatch;
        let matches: Vec<PointMatch> = [[0.0, 0.0], [400.0, 10.0], [380.0, 300.0], [20.0, 250.0]]
            .map(|source| {
                let mapped = view() * Vector2::from(source).push(1.0);
                PointMatch {
                    source: source.into(),
                    target: mapped.xy() / mapped.z,
                }
            })
            .to_vec();
        let conditioning = Conditioning::of(&matches).unwrap();
        let mut H = view();
        H[(1, 0)] *= 1.3;
        let conditioned = rigidity().conditioned(&conditioning).unwrap();
        let (a, _) = rigidity().residuals(&H);
        let (b, _) = conditioned.residuals(&conditioning.conditioned(&H).unwrap());
        assert!((a - b).norm() < 1e-9);
    }
}
