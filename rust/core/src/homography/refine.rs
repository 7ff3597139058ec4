//! Non-linear refinement of a homography.

use nalgebra::{Matrix3, SVector};

use super::PointMatch;
use super::conditioning::Conditioning;
use super::rigidity::Rigidity;
use super::sums::{PARAMETERS, Sums};
use crate::lm::{LeastSquares, Normal, Precision, minimize};

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

    fn linearize(&self, H: &Matrix3<f64>) -> Normal<PARAMETERS> {
        let sums = Sums::at(H, self.matches, self.inverse_scale);
        let (gradient, hessian) = sums.normal();
        let mut normal = Normal {
            cost: sums.cost,
            gradient,
            hessian,
        };
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

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::{SMatrix, Vector2};

    use super::*;
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
    fn the_gradient_is_that_of_the_cost() {
        let matches = matches(0.5);
        let problem = Problem {
            matches: &matches,
            inverse_scale: 0.7,
            prior: None,
        };
        let entries = [0.61, -0.1, 200.3, 0.15, 0.51, 149.0, 1e-4, -3e-4];
        let at = |h: &[f64; 8]| Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
        let normal = problem.linearize(&at(&entries));
        let cost = |entries: &[f64; 8]| problem.linearize(&at(entries)).cost;
        // The cost is a sum of losses, the gradient half of its derivative.
        for (i, scale) in [1e-6, 1e-6, 1e-4, 1e-6, 1e-6, 1e-4, 1e-9, 1e-9]
            .iter()
            .enumerate()
        {
            let (mut below, mut above) = (entries, entries);
            below[i] -= scale;
            above[i] += scale;
            let slope = (cost(&above) - cost(&below)) / (2.0 * scale);
            let error = (normal.gradient[i] - 0.5 * slope).abs();
            assert!(error <= 1e-5 * slope.abs() + 1e-3, "{i} {error} {slope}");
        }
    }

    #[test]
    fn the_hessian_is_that_of_the_residuals() {
        let matches = &matches(0.5)[..5];
        let problem = Problem {
            matches,
            inverse_scale: 0.7,
            prior: None,
        };
        let mut expected = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
        for point in matches {
            let source = point.source.push(1.0);
            let mapped = TRUTH * source;
            let image = mapped.xy() / mapped.z;
            let p = source / mapped.z;
            let jacobian = SMatrix::<f64, 2, PARAMETERS>::from_fn(|i, entry| {
                let by_row = match entry / 3 {
                    2 => -image[i],
                    row if row == i => 1.0,
                    _ => 0.0,
                };
                by_row * p[entry % 3]
            });
            let squared = (image - point.target).norm_squared() * 0.49;
            expected += jacobian.transpose() * jacobian * (0.49 / (1.0 + squared));
        }
        let found = problem.linearize(&TRUTH).hessian;
        assert!((found - expected).norm() < 1e-12 * expected.norm());
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
