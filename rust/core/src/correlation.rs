//! How many pixels of a depth image count as one measurement.
//!
//! Depth cameras smooth and interpolate: neighbouring errors are alike, and thousands of pixels on a
//! face say far less about its plane than as many independent ones. The residuals of the fitted
//! plane tell: summed over blocks, independent errors cancel and common ones do not (the cluster
//! variance of Liang and Zeger 1986, with one factor for all parameters).

use nalgebra::{Vector2, Vector3};

use crate::depth_region::DepthPixel;
use crate::robust::tukey_weight;

/// Blocks across the face: coarse enough to hold bumps, with degrees of freedom to spare.
const BLOCKS_ACROSS: usize = 6;
/// Errors of real depth cameras grow with their extent, and the plane swallows the largest: what the
/// residuals show beyond independent noise is taken this many times. On a recorded stereo sequence
/// the pose error is flat from 2 to 4; independent noise is not touched by it.
const UNSEEN: f64 = 3.0;
/// Degrees of freedom that the plane takes from the blocks.
const PLANE: f64 = 3.0;

/// How many samples count as one, at least 1: the variance of block sums of residuals over that of
/// independent ones, with what the plane hides.
pub fn samples_per_measurement(pixels: &[DepthPixel], q: &Vector3<f64>, sigma: f64) -> f64 {
    let empty = Vector2::repeat(f64::INFINITY);
    let bounds = |(low, high): (Vector2<f64>, Vector2<f64>), pixel: &DepthPixel| {
        (low.inf(&pixel.ray.xy()), high.sup(&pixel.ray.xy()))
    };
    let (low, high) = pixels.iter().fold((empty, -empty), bounds);
    let scale = (high - low).map(|size| BLOCKS_ACROSS as f64 / size.max(f64::MIN_POSITIVE));
    let mut sums = [(0.0, 0usize); BLOCKS_ACROSS * BLOCKS_ACROSS];
    let mut independent = 0.0;
    for pixel in pixels {
        let residual = (q.dot(&pixel.ray) - pixel.inverse_depth) / sigma;
        let weighted = residual * tukey_weight(residual);
        let block = (pixel.ray.xy() - low).component_mul(&scale);
        let index = |x: f64| (x as usize).min(BLOCKS_ACROSS - 1);
        let (sum, count) = &mut sums[index(block.y) * BLOCKS_ACROSS + index(block.x)];
        *sum += weighted;
        *count += 1;
        independent += weighted * weighted;
    }
    let blocks = sums.iter().filter(|(_, count)| *count > 0).count() as f64;
    let common: f64 = sums.iter().map(|(sum, _)| sum * sum).sum();
    if blocks <= PLANE || independent <= 0.0 {
        return 1.0;
    }
    let shown = common / independent * blocks / (blocks - PLANE);
    1.0 + UNSEEN * (shown - 1.0).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::tests::{TRUTH, patch};

    #[test]
    fn independent_noise_counts_fully() {
        let count = samples_per_measurement(&patch(2e-3, 0.0, 0.0), &TRUTH, 2e-3);
        // 36 blocks: the deviation of what is shown is √(2 / 36) = 0.24, here two of them thrice.
        assert!((1.0..2.5).contains(&count), "{count}");
    }

    #[test]
    fn a_bumpy_surface_counts_by_its_bumps() {
        // Waves of a third of the patch, as strong as the noise: about a twentieth
        // of the patch alike, and that thrice.
        let mut pixels = patch(1e-3, 0.0, 0.0);
        for pixel in &mut pixels {
            let phase = pixel.ray.xy() * (std::f64::consts::TAU / 0.04);
            pixel.inverse_depth += 2e-3 * phase.x.sin() * phase.y.sin();
        }
        let count = samples_per_measurement(&pixels, &TRUTH, 2e-3);
        assert!((60.0..300.0).contains(&count), "{count}");
    }

    #[test]
    fn what_cannot_be_told_counts_fully() {
        assert_eq!(samples_per_measurement(&[], &TRUTH, 1e-3), 1.0);
        let one = patch(1e-3, 0.0, 0.0)[0];
        assert_eq!(samples_per_measurement(&[one; 50], &TRUTH, 1e-3), 1.0);
        assert_eq!(
            samples_per_measurement(&patch(0.0, 0.0, 0.0), &TRUTH, 2e-4),
            1.0
        );
    }
}
