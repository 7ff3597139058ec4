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

/// A product beyond this is taken the logarithm of: another factor must not overflow.
const LARGEST_PRODUCT: f64 = 1e100;

/// Weight by Cauchy's loss: bounded influence, yet never blind, so that a coarse start converges.
pub fn cauchy_weight(squared: f64) -> f64 {
    1.0 / (1.0 + squared / CAUCHY_SCALE_SQUARED)
}

/// Sum of logarithms: that of a product is that of many factors at once, and logarithms are most of
/// what a sum of single ones costs.
#[derive(Debug, Clone, Copy)]
pub struct LogSum {
    logarithms: f64,
    product: f64,
}

impl Default for LogSum {
    /// Of nothing.
    fn default() -> Self {
        Self {
            logarithms: 0.0,
            product: 1.0,
        }
    }
}

impl LogSum {
    /// Adds the logarithm of a number ≥ 1.
    pub fn add(&mut self, factor: f64) {
        self.product *= factor;
        if self.product > LARGEST_PRODUCT {
            self.logarithms += self.product.ln();
            self.product = 1.0;
        }
    }

    /// The sum.
    pub fn total(&self) -> f64 {
        self.logarithms + self.product.ln()
    }
}

/// Sum of Cauchy's losses c²·ln(1 + r²/c²).
#[derive(Debug, Clone, Copy, Default)]
pub struct CauchySum(LogSum);

impl CauchySum {
    /// Adds the loss of one squared residual, and returns its weight.
    pub fn add(&mut self, squared: f64) -> f64 {
        let factor = 1.0 + squared / CAUCHY_SCALE_SQUARED;
        self.0.add(factor);
        1.0 / factor
    }

    /// The sum.
    pub fn total(&self) -> f64 {
        CAUCHY_SCALE_SQUARED * self.0.total()
    }
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

    fn cauchy(squared: &[f64]) -> f64 {
        let mut sum = CauchySum::default();
        for one in squared {
            let weight = sum.add(*one);
            assert!(weight == cauchy_weight(*one) || one.is_nan());
        }
        sum.total()
    }

    #[test]
    fn the_cauchy_weight_is_the_derivative_of_its_loss() {
        for squared in [0.0, 0.5, 9.0, 400.0] {
            let step = 1e-5;
            let slope = (cauchy(&[squared + step]) - cauchy(&[squared - step])) / (2.0 * step);
            assert!((slope - cauchy_weight(squared)).abs() < 1e-8);
        }
        assert_eq!(cauchy_weight(9.0), 0.5);
    }

    #[test]
    fn the_sum_of_losses_is_that_of_single_ones() {
        let squared: Vec<f64> = (0..2000).map(|i| f64::from(i).powi(2) * 1e3).collect();
        let singly: f64 = squared.iter().map(|s| 9.0 * (s / 9.0).ln_1p()).sum();
        assert!((cauchy(&squared) / singly - 1.0).abs() < 1e-12);
        assert_eq!(cauchy(&[]), 0.0);
        assert!((cauchy(&[1e-9]) - 1e-9).abs() < 1e-14);
        let mut sum = LogSum::default();
        (1..2000).for_each(|i| sum.add(f64::from(i)));
        // ln(1999!)
        let expected: f64 = (1..2000).map(|i| f64::from(i).ln()).sum();
        assert!((sum.total() / expected - 1.0).abs() < 1e-12);
        assert!(cauchy(&[f64::INFINITY]).is_infinite());
        assert!(cauchy(&[f64::NAN]).is_nan());
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
