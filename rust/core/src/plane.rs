//! Robust plane in inverse depth.
//!
//! The noise of structured light and stereo is uniform in disparity, and so in inverse depth:
//! w = q·(x, y, 1) is fitted to rays and inverse depths by iteratively reweighted least squares with
//! Tukey's biweight, from a consensus start.

use nalgebra::{Matrix3, Vector3};

use crate::depth_region::DepthPixel;
use crate::robust::{MAD_TO_SIGMA, TUKEY_CUTOFF, median, tukey_weight};

const ITERATIONS: usize = 8;
/// The scale is estimated from so many residuals at most: to 4 % of itself.
const SCALE_PIXELS: usize = 1000;
/// Relative change of the scale at which the fit has settled.
const SETTLED: f64 = 1e-3;

/// How the noise of the inverse depth is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// Known standard deviation [1/m].
    Known(f64),
    /// Estimated from the residuals, not below this [1/m].
    AtLeast(f64),
}

impl Noise {
    fn sigma(self, estimated: f64) -> f64 {
        match self {
            Self::Known(sigma) => sigma,
            Self::AtLeast(floor) => estimated.max(floor),
        }
    }
}

/// A plane with its certainty, every pixel counted as an independent measurement.
#[derive(Debug, Clone)]
pub struct FittedPlane {
    /// q: inverse depth is q·(x, y, 1) on the normalised plane [1/m].
    pub inverse_plane: Vector3<f64>,
    /// Information of `inverse_plane` [m²].
    pub information: Matrix3<f64>,
    /// Standard deviation of the inverse depth of one pixel [1/m].
    pub sigma: f64,
    /// How many pixels carry weight.
    pub inliers: usize,
}

/// Fits from a start and its scale [1/m]; `None` when the pixels with weight span no plane.
pub fn fit(
    pixels: &[DepthPixel],
    start: Vector3<f64>,
    start_sigma: f64,
    noise: Noise,
) -> Option<FittedPlane> {
    let mut q = start;
    let mut sigma = noise.sigma(start_sigma);
    let step = pixels.len().div_ceil(SCALE_PIXELS).max(1);
    let mut residuals = Vec::with_capacity(SCALE_PIXELS);
    for _ in 0..ITERATIONS {
        let (left, right, _) = normal_equations(pixels, &q, sigma);
        q = left.cholesky()?.solve(&right);
        residuals.clear();
        residuals.extend(
            pixels
                .iter()
                .step_by(step)
                .map(|pixel| (q.dot(&pixel.ray) - pixel.inverse_depth).abs())
                .filter(|&residual| residual < TUKEY_CUTOFF * sigma),
        );
        let next = noise.sigma(MAD_TO_SIGMA * median(&mut residuals)?);
        let settled = (next / sigma - 1.0).abs() < SETTLED;
        sigma = next;
        if settled {
            break;
        }
    }
    let (left, right, inliers) = normal_equations(pixels, &q, sigma);
    let inverse_plane = left.cholesky()?.solve(&right);
    let information = left / (sigma * sigma);
    let finite = inverse_plane
        .iter()
        .chain(&information)
        .all(|value| value.is_finite());
    finite.then_some(FittedPlane {
        inverse_plane,
        information,
        sigma,
        inliers,
    })
}

/// Σ ω m mᵀ, Σ ω w m and the number of weights ω > 0.
fn normal_equations(
    pixels: &[DepthPixel],
    q: &Vector3<f64>,
    sigma: f64,
) -> (Matrix3<f64>, Vector3<f64>, usize) {
    // Rays are (x, y, 1): six different products, and three with the inverse depth.
    let mut products = [0.0; 6];
    let mut with_depth = [0.0; 3];
    let mut inliers = 0;
    let precision = 1.0 / sigma;
    for pixel in pixels {
        let (x, y, w) = (pixel.ray.x, pixel.ray.y, pixel.inverse_depth);
        let weight = tukey_weight((q.x * x + q.y * y + q.z - w) * precision);
        if weight > 0.0 {
            let (wx, wy) = (weight * x, weight * y);
            for (sum, product) in products
                .iter_mut()
                .zip([wx * x, wx * y, wx, wy * y, wy, weight])
            {
                *sum += product;
            }
            for (sum, product) in with_depth.iter_mut().zip([wx * w, wy * w, weight * w]) {
                *sum += product;
            }
            inliers += 1;
        }
    }
    let [xx, xy, x, yy, y, one] = products;
    let left = Matrix3::new(xx, xy, x, xy, yy, y, x, y, one);
    (left, Vector3::from(with_depth), inliers)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
pub(crate) mod tests {
    use super::*;
    use crate::random::SplitMix64;

    pub const TRUTH: Vector3<f64> = Vector3::new(0.8, -0.5, 1.4);

    /// A 60 × 60 patch of the true plane, the given share of it (by columns) nearer by `offset`.
    pub fn patch(sigma: f64, share: f64, offset: f64) -> Vec<DepthPixel> {
        let mut random = SplitMix64::new(7);
        let mut pixel = |i: usize, j: usize| {
            let ray = Vector3::new(i as f64 / 500.0 - 0.06, j as f64 / 500.0 - 0.06, 1.0);
            let covered = (i as f64) < 60.0 * share;
            let nearer = if covered { offset } else { 0.0 };
            DepthPixel {
                ray,
                inverse_depth: TRUTH.dot(&ray) + nearer + sigma * random.normal(),
                near_match: !covered,
            }
        };
        (0..60)
            .flat_map(|i| (0..60).map(move |j| (i, j)))
            .map(|(i, j)| pixel(i, j))
            .collect()
    }

    #[test]
    fn exact_pixels_give_the_exact_plane() {
        let plane = fit(
            &patch(0.0, 0.0, 0.0),
            TRUTH * 1.001,
            0.01,
            Noise::AtLeast(2e-4),
        )
        .unwrap();
        assert!((plane.inverse_plane - TRUTH).norm() < 1e-9);
        assert_eq!((plane.sigma, plane.inliers), (2e-4, 3600));
    }

    #[test]
    fn the_noise_is_estimated_and_the_information_matches_the_error() {
        let plane = fit(&patch(2e-3, 0.0, 0.0), TRUTH, 0.01, Noise::AtLeast(1e-6)).unwrap();
        assert!((plane.sigma / 2e-3 - 1.0).abs() < 0.05, "{}", plane.sigma);
        let error = plane.inverse_plane - TRUTH;
        // Chi-squared with three degrees of freedom: 16.3 is exceeded once in a thousand.
        assert!(error.dot(&(plane.information * error)) < 16.3);
        let known = fit(&patch(2e-3, 0.0, 0.0), TRUTH, 0.01, Noise::Known(4e-3)).unwrap();
        assert_eq!(known.sigma, 4e-3);
    }

    #[test]
    fn a_nearer_part_does_not_pull() {
        // 2 cm nearer at 0.7 m is 0.04 1/m.
        let plane = fit(&patch(2e-3, 0.4, 0.04), TRUTH, 3e-3, Noise::AtLeast(2e-4)).unwrap();
        assert!(
            (plane.inverse_plane - TRUTH).amax() < 4e-3,
            "{}",
            plane.inverse_plane
        );
        assert!((plane.inliers as f64 / 2160.0 - 1.0).abs() < 0.02);
    }

    #[test]
    fn pixels_on_a_line_span_no_plane() {
        let line: Vec<_> = patch(0.0, 0.0, 0.0).into_iter().take(60).collect();
        assert!(fit(&line, TRUTH, 0.01, Noise::AtLeast(2e-4)).is_none());
        assert!(fit(&[], TRUTH, 0.01, Noise::AtLeast(2e-4)).is_none());
    }
}
