//! A first plane that up to half of wrong pixels cannot mislead.
//!
//! Least median of squares (Rousseeuw 1984) over planes through three pixels. It asks first the
//! pixels next to matched image points: there the face itself is seen, whatever covers the rest.

use nalgebra::{Matrix3, Vector3};

use crate::depth_region::DepthPixel;
use crate::random::SplitMix64;
use crate::robust::{MAD_TO_SIGMA, median};

/// At 60 % of right pixels all hypotheses contain a wrong one with a probability of 1e-10.
const HYPOTHESES: usize = 96;
/// Pixels that each hypothesis is judged by.
const JUDGES: usize = 250;
/// Pixels next to matches must number this many, else all pixels are asked.
const MIN_VOUCHED: usize = 30;

/// The best plane q and the standard deviation of the residuals about it [1/m].
pub fn least_median(pixels: &[DepthPixel], seed: u64) -> Option<(Vector3<f64>, f64)> {
    let vouched: Vec<&DepthPixel> = pixels.iter().filter(|pixel| pixel.near_match).collect();
    let asked = if vouched.len() >= MIN_VOUCHED {
        vouched
    } else {
        pixels.iter().collect()
    };
    let judges: Vec<&DepthPixel> = asked
        .iter()
        .step_by(asked.len().div_ceil(JUDGES).max(1))
        .copied()
        .collect();
    let mut random = SplitMix64::new(seed);
    let mut residuals = vec![0.0; judges.len()];
    let mut best: Option<(Vector3<f64>, f64)> = None;
    for _ in 0..HYPOTHESES {
        let mut draw = || asked.get(random.index(asked.len())).copied();
        let Some(q) = through(draw()?, draw()?, draw()?) else {
            continue;
        };
        for (residual, pixel) in residuals.iter_mut().zip(&judges) {
            *residual = (q.dot(&pixel.ray) - pixel.inverse_depth).abs();
        }
        // Counting is quicker than selecting, and most hypotheses are no better than the best.
        let is_better = best.is_none_or(|(_, lowest)| {
            residuals.iter().filter(|&&r| r < lowest).count() > residuals.len() / 2
        });
        if is_better {
            best = Some((q, median(&mut residuals)?));
        }
    }
    best.map(|(q, score)| (q, MAD_TO_SIGMA * score))
}

fn through(a: &DepthPixel, b: &DepthPixel, c: &DepthPixel) -> Option<Vector3<f64>> {
    let rows = Matrix3::from_rows(&[a.ray.transpose(), b.ray.transpose(), c.ray.transpose()]);
    let q = rows.try_inverse()? * Vector3::new(a.inverse_depth, b.inverse_depth, c.inverse_depth);
    q.iter().all(|value| value.is_finite()).then_some(q)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::plane::tests::{TRUTH, patch};

    #[test]
    fn a_covered_minority_does_not_win() {
        let (q, sigma) = least_median(&patch(2e-3, 0.4, 0.04), 0).unwrap();
        assert!((q - TRUTH).amax() < 0.03, "{q}");
        assert!(sigma < 4e-3, "{sigma}");
    }

    #[test]
    fn matches_vouch_for_the_face_against_a_covering_majority() {
        let mut pixels = patch(2e-3, 0.7, 0.1);
        let (q, _) = least_median(&pixels, 0).unwrap();
        assert!((q - TRUTH).amax() < 0.1, "{q}");
        // Without their word the majority wins: what the test above would not notice.
        pixels.iter_mut().for_each(|pixel| pixel.near_match = false);
        let (q, _) = least_median(&pixels, 0).unwrap();
        let covering = TRUTH + Vector3::new(0.0, 0.0, 0.1);
        assert!((q - covering).amax() < 0.05, "{q}");
    }

    #[test]
    fn the_same_seed_gives_the_same_plane() {
        let pixels = patch(2e-3, 0.4, 0.04);
        assert_eq!(least_median(&pixels, 5), least_median(&pixels, 5));
    }

    #[test]
    fn nothing_gives_no_plane() {
        assert_eq!(least_median(&[], 0), None);
        let one = patch(0.0, 0.0, 0.0)[0];
        assert_eq!(least_median(&[one; 40], 0), None);
    }
}
