//! Robust losses and scales.
//!
//! Losses take a squared, whitened residual and equal it near zero; the weight of a residual in
//! iteratively reweighted least squares is the derivative of the loss with respect to it.

/// Turns a median absolute deviation into the standard deviation of a Gaussian.
pub const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;

/// Tukey's biweight leaves residuals beyond this many sigmas out (95 % Gaussian efficiency).
pub const TUKEY_CUTOFF: f64 = 4.685;

/// Squared scale of [`cauchy`]: a two-dimensional residual of three sigmas counts half.
const CAUCHY_SCALE_SQUARED: f64 = 9.0;

/// Cauchy's loss and weight: bounded influence, yet never blind, so that a coarse start converges.
pub fn cauchy(squared: f64) -> (f64, f64) {
    let ratio = squared / CAUCHY_SCALE_SQUARED;
    (CAUCHY_SCALE_SQUARED * ratio.ln_1p(), 1.0 / (1.0 + ratio))
}

/// Weight of Tukey's biweight.
pub fn tukey_weight(residual_over_sigma: f64) -> f64 {
    let ratio = residual_over_sigma / TUKEY_CUTOFF;
    let inside = 1.0 - ratio * ratio;
    if inside > 0.0 { inside * inside } else { 0.0 }
}

/// Median by selection; reorders `values`. `None` when empty.
pub fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cauchy_weight_is_the_derivative_of_its_loss() {
        for squared in [0.0, 0.5, 9.0, 400.0] {
            let step = 1e-5;
            let slope = (cauchy(squared + step).0 - cauchy(squared - step).0) / (2.0 * step);
            assert!((slope - cauchy(squared).1).abs() < 1e-8);
        }
        assert_eq!(cauchy(9.0).1, 0.5);
    }

    #[test]
    fn tukey_leaves_far_residuals_out() {
        assert_eq!(tukey_weight(0.0), 1.0);
        assert_eq!(tukey_weight(4.7), 0.0);
        assert_eq!(tukey_weight(-50.0), 0.0);
        assert!(tukey_weight(2.0) > tukey_weight(3.0));
    }

    #[test]
    fn the_median_of_nothing_is_none() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
    }
}
