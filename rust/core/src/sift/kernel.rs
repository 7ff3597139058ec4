//! Gaussian kernels, cut off, and normalised in sum and width.

/// Blur that an image as taken is assumed to have [px] (Lowe, section 3.3).
const CAMERA_SIGMA: f64 = 0.5;

/// Where a kernel ends [σ].
const REACH: f64 = 2.4;

/// Taps of a Gaussian at -radius…radius whose standard deviation is `sigma`.
///
/// Cutting a Gaussian off narrows it, which would shift all scales: the one that is cut off is as
/// much wider.
pub fn gaussian(sigma: f64) -> Vec<f32> {
    let radius = (REACH * sigma).ceil() as i64;
    let mut wider = sigma;
    // Each step closes most of the gap that is left, a tenth at first.
    for _ in 0..50 {
        let variance: f64 = sampled(wider, radius)
            .zip(-radius..)
            .map(|(weight, i)| weight * (i * i) as f64)
            .sum();
        wider *= sigma / variance.sqrt();
    }
    sampled(wider, radius).map(|weight| weight as f32).collect()
}

/// A Gaussian at -radius…radius, normalised.
fn sampled(sigma: f64, radius: i64) -> impl Iterator<Item = f64> {
    let weight = move |i: i64| (-0.5 * (i as f64 / sigma).powi(2)).exp();
    let sum: f64 = (-radius..=radius).map(weight).sum();
    (-radius..=radius).map(move |i| weight(i) / sum)
}

/// Blurs from each level of an octave to the next; level i has σ·2^(i / layers).
pub fn increments(sigma: f64, layers: usize) -> Vec<f64> {
    let step = 2f64.powf(1.0 / layers as f64);
    (0..layers + 2)
        .map(|i| sigma * step.powi(i as i32) * (step * step - 1.0).sqrt())
        .collect()
}

/// One output phase of [`FirstKernel`].
#[derive(Debug, Clone)]
pub struct Phase {
    /// Index of the first tap relative to the input pixel.
    pub offset: isize,
    /// Weights of consecutive input pixels.
    pub taps: Vec<f32>,
}

/// From pixels of the image to the first level of the first octave, along one axis.
///
/// Enlarging by bilinear interpolation and blurring are one linear filter, whose taps differ
/// between outputs on a pixel and outputs between two: output `factor`·i + p is phase p applied at
/// input pixel i. Output n lies at n / `factor` pixels of the image, so that pixel centres coincide.
#[derive(Debug, Clone)]
pub struct FirstKernel {
    /// One kernel for each output between two input pixels; their number is the enlargement.
    pub phases: Vec<Phase>,
}

impl FirstKernel {
    /// The filter that gives the first octave a blur of `sigma` [its px].
    pub fn new(sigma: f64, doubled: bool) -> Self {
        let factor = if doubled { 2.0 } else { 1.0 };
        let taps = gaussian((sigma * sigma - (factor * CAMERA_SIGMA).powi(2)).sqrt());
        let radius = (taps.len() / 2) as isize;
        let phases = if doubled {
            (0..2).map(|phase| enlarged(&taps, phase)).collect()
        } else {
            vec![Phase {
                offset: -radius,
                taps,
            }]
        };
        Self { phases }
    }

    /// How many outputs there are for each input.
    pub fn factor(&self) -> usize {
        self.phases.len()
    }

    /// Farthest input pixel that is looked at.
    pub fn reach(&self) -> usize {
        let reach = |phase: &Phase| {
            let last = phase.offset + phase.taps.len() as isize - 1;
            last.max(-phase.offset) as usize
        };
        self.phases.iter().map(reach).max().unwrap_or(0)
    }
}

/// `taps` on an axis of twice the resolution as a filter of the original axis.
fn enlarged(taps: &[f32], phase: isize) -> Phase {
    let radius = (taps.len() / 2) as isize;
    let offset = (phase - radius).div_euclid(2);
    let last = (phase + radius).div_euclid(2) + 1;
    let mut folded = vec![0.0; (last - offset + 1) as usize];
    for (k, &tap) in (-radius..=radius).zip(taps) {
        // The enlarged axis has input pixels at even places and means of two at odd ones.
        let place = phase + k;
        let below = (place.div_euclid(2) - offset) as usize;
        if place % 2 == 0 {
            folded[below] += tap;
        } else {
            folded[below] += 0.5 * tap;
            folded[below + 1] += 0.5 * tap;
        }
    }
    while folded.last() == Some(&0.0) {
        folded.pop();
    }
    Phase {
        offset,
        taps: folded,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// Convolution of an endless row given as a function.
    fn at(taps: &[f32], offset: isize, row: impl Fn(isize) -> f64, x: isize) -> f64 {
        taps.iter()
            .zip(offset..)
            .map(|(&tap, k)| f64::from(tap) * row(x + k))
            .sum()
    }

    #[test]
    fn a_kernel_has_its_sigma() {
        for sigma in [1.2, 2.5, 9.0] {
            let taps = gaussian(sigma);
            let radius = (taps.len() / 2) as isize;
            let variance = at(&taps, -radius, |x| (x * x) as f64, 0);
            assert!((variance.sqrt() / sigma - 1.0).abs() < 1e-5, "{sigma}");
        }
    }

    #[test]
    fn blurs_add_up_to_the_levels() {
        let blurs = increments(1.6, 3);
        let variance: f64 = 1.6f64.powi(2) + blurs[..3].iter().map(|s| s * s).sum::<f64>();
        assert!((variance.sqrt() - 3.2).abs() < 1e-9);
        assert_eq!(blurs.len(), 5);
    }

    #[test]
    fn doubling_is_bilinear_enlargement_and_blur() {
        let image = |x: isize| (x as f64 * 0.9).sin() + 0.1 * x as f64;
        let doubled = |n: isize| {
            let i = n.div_euclid(2);
            if n % 2 == 0 {
                image(i)
            } else {
                0.5 * (image(i) + image(i + 1))
            }
        };
        let plain = gaussian((1.6f64.powi(2) - 1.0).sqrt());
        let radius = (plain.len() / 2) as isize;
        let kernel = FirstKernel::new(1.6, true);
        for n in 0..10 {
            let phase = &kernel.phases[n as usize % 2];
            let found = at(&phase.taps, phase.offset, image, n / 2);
            let expected = at(&plain, -radius, doubled, n);
            assert!((found - expected).abs() < 1e-6, "{n}");
        }
        assert_eq!((kernel.factor(), kernel.reach()), (2, 2));
    }
}
