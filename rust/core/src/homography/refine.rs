//! Non-linear refinement of a homography.

use nalgebra::{Matrix2x3, Matrix3, RowVector3, SMatrix, SVector};

use super::PointMatch;
use super::conditioning::Conditioning;
use super::rigidity::Rigidity;
use crate::lm::{LeastSquares, Normal, Precision, minimize};

/// Eight parameters: all entries but the last, which is held at its value of the start.
const PARAMETERS: usize = 8;

/// How rigid the view is expected to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    /// The constraints of a rigid view.
    pub rigidity: Rigidity,
    /// Standard deviation of their residuals: relative error of the taught aspect ratio.
    pub sigma: f64,
}

/// Minimises Σ Cauchy(‖H·source - target‖² / scale²) from a start, plus the prior's squares.
///
/// `scale` is in units of the target: residuals beyond it count less and less. `None` where the
/// matches do not determine a homography or the start is impossible.
pub fn refine(
    matches: &[PointMatch],
    start: &Matrix3<f64>,
    scale: f64,
    prior: Option<&Prior>,
) -> Option<Matrix3<f64>> {
    let conditioning = Conditioning::of(matches)?;
    let conditioned: Vec<PointMatch> = matches
        .iter()
        .map(|point| conditioning.condition(point))
        .collect();
    let prior = match prior {
        Some(prior) => Some(Prior {
            rigidity: prior.rigidity.conditioned(&conditioning)?,
            sigma: prior.sigma,
        }),
        None => None,
    };
    let refined = refine_conditioned(
        &conditioned,
        &conditioning.conditioned(start)?,
        conditioning.target_length(scale),
        prior.as_ref(),
        Precision::Fine,
    )?;
    conditioning.original(&refined)
}

/// [`refine`] in conditioned coordinates.
pub fn refine_conditioned(
    matches: &[PointMatch],
    start: &Matrix3<f64>,
    scale: f64,
    prior: Option<&Prior>,
    precision: Precision,
) -> Option<Matrix3<f64>> {
    if matches.len() < 4 || start[(2, 2)].abs() < 1e-9 {
        return None;
    }
    let problem = Problem {
        matches,
        inverse_scale: 1.0 / scale,
        prior,
    };
    let minimum = minimize(&problem, start / start[(2, 2)], precision)?;
    Some(minimum.state)
}

struct Problem<'a> {
    matches: &'a [PointMatch],
    inverse_scale: f64,
    prior: Option<&'a Prior>,
}

impl LeastSquares<PARAMETERS> for Problem<'_> {
    type State = Matrix3<f64>;

    fn cost(&self, H: &Matrix3<f64>) -> f64 {
        let departure = self.prior.map_or(0.0, |prior| {
            prior.rigidity.residuals(H).0.norm_squared() / prior.sigma.powi(2)
        });
        let losses = self.matches.iter().map(|point| {
            let squared = point.squared_error(H) * self.inverse_scale.powi(2);
            squared.ln_1p()
        });
        departure + losses.sum::<f64>()
    }

    fn linearize(&self, H: &Matrix3<f64>) -> Normal<PARAMETERS> {
        let mut normal = Normal {
            cost: 0.0,
            gradient: SVector::zeros(),
            hessian: SMatrix::zeros(),
        };
        for point in self.matches {
            let source = point.source.push(1.0);
            let mapped = H * source;
            if mapped.z <= 0.0 {
                normal.cost = f64::INFINITY;
                return normal;
            }
            let image = mapped.xy() / mapped.z;
            let residual = (image - point.target) * self.inverse_scale;
            let squared = residual.norm_squared();
            let weight = 1.0 / (1.0 + squared);
            let jacobian = jacobian(&source.transpose(), &image, mapped.z) * self.inverse_scale;
            let weighted = jacobian.transpose() * weight;
            normal.cost += squared.ln_1p();
            normal.gradient += weighted * residual;
            normal.hessian += weighted * jacobian;
        }
        if let Some(prior) = self.prior {
            let (residuals, jacobian) = prior.rigidity.residuals(H);
            let weighted = jacobian.transpose() / prior.sigma.powi(2);
            normal.cost += residuals.norm_squared() / prior.sigma.powi(2);
            normal.gradient += weighted * residuals;
            normal.hessian += weighted * jacobian;
        }
        normal
    }

    fn moved(&self, H: &Matrix3<f64>, step: &SVector<f64, PARAMETERS>) -> Matrix3<f64> {
        let mut moved = *H;
        for (i, value) in step.iter().enumerate() {
            moved[(i / 3, i % 3)] += value;
        }
        moved
    }
}

/// Of the image point by the first eight entries of H, row by row.
fn jacobian(
    source: &RowVector3<f64>,
    image: &nalgebra::Vector2<f64>,
    depth: f64,
) -> SMatrix<f64, 2, PARAMETERS> {
    let row = source / depth;
    let mut by_last_row = Matrix2x3::zeros();
    by_last_row.row_mut(0).copy_from(&(row * -image.x));
    by_last_row.row_mut(1).copy_from(&(row * -image.y));
    let mut jacobian = SMatrix::<f64, 2, PARAMETERS>::zeros();
    jacobian.fixed_view_mut::<1, 3>(0, 0).copy_from(&row);
    jacobian.fixed_view_mut::<1, 3>(1, 3).copy_from(&row);
    jacobian
        .fixed_view_mut::<2, 2>(0, 6)
        .copy_from(&by_last_row.fixed_view::<2, 2>(0, 0));
    jacobian
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Vector2;

    use super::*;
    use crate::numeric::assert_jacobian;
    use crate::random::SplitMix64;

    const TRUTH: Matrix3<f64> = Matrix3::new(0.6, -0.1, 200.0, 0.15, 0.5, 150.0, 1e-4, -3e-4, 1.0);

    fn matches(sigma: f64) -> Vec<PointMatch> {
        let mut random = SplitMix64::new(5);
        (0..200)
            .map(|_| {
                let source = Vector2::new(400.0 * random.uniform(), 300.0 * random.uniform());
                let mapped = TRUTH * source.push(1.0);
                let noise = Vector2::new(random.normal(), random.normal()) * sigma;
                PointMatch {
                    source,
                    target: mapped.xy() / mapped.z + noise,
                }
            })
            .collect()
    }

    #[test]
    fn the_jacobian_is_the_derivative() {
        let source = Vector2::new(0.3, -0.7).push(1.0);
        let entries = [0.9, 0.1, -0.2, 0.05, 1.1, 0.3, 0.2, -0.1];
        let map = |h: &[f64; 8]| {
            let H = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
            let mapped = H * source;
            [mapped.x / mapped.z, mapped.y / mapped.z]
        };
        let depth = 0.2 * 0.3 + 0.1 * 0.7 + 1.0;
        let image = Vector2::from(map(&entries));
        assert_jacobian(map, &entries, jacobian(&source.transpose(), &image, depth));
    }

    #[test]
    fn exact_matches_lead_back_to_the_truth() {
        let mut start = TRUTH;
        start[(0, 2)] += 8.0;
        start[(1, 0)] += 0.03;
        let H = refine(&matches(0.0), &start, 1.0, None).unwrap();
        assert!((H / H[(2, 2)] - TRUTH).amax() < 1e-5, "{H}");
    }

    #[test]
    fn noise_and_a_tenth_of_outliers_leave_a_fraction_of_a_pixel() {
        let mut noisy = matches(0.5);
        for point in noisy.iter_mut().step_by(10) {
            point.target.x += 40.0;
        }
        let H = refine(&noisy, &TRUTH, 1.0, None).unwrap();
        // 180 points of 0.5 px over eight parameters: 0.5·√(8/360) ≈ 0.07 px; three times that.
        for corner in [[0.0, 0.0], [400.0, 0.0], [400.0, 300.0], [0.0, 300.0]] {
            let source = Vector2::from(corner).push(1.0);
            let (a, b) = (H * source, TRUTH * source);
            assert!((a.xy() / a.z - b.xy() / b.z).norm() < 0.25);
        }
    }

    #[test]
    fn too_little_is_refused() {
        assert_eq!(refine(&matches(0.0)[..3], &TRUTH, 1.0, None), None);
        assert_eq!(refine(&[], &TRUTH, 1.0, None), None);
        let same = vec![matches(0.0)[0]; 10];
        assert_eq!(refine(&same, &TRUTH, 1.0, None), None);
    }
}
