//! Orientation of a neighbourhood from Haar wavelets (Bay et al., section 4.1).

use std::f32::consts::{FRAC_PI_2, PI};

use super::descriptor::DIAMETER;
use super::patch::{Grid, round, sample};
use super::smoothed::Smoothed;
use crate::Keypoint;

/// Wavelets along the side of the square around the disc in which they are taken.
const SITES: usize = 13;
/// Samples along its side: a wavelet looks at four by four, two on either side of its centre.
const SAMPLES: usize = 16;
/// Directions of gradients are told apart to 5°.
const BINS: usize = 72;
/// Bins of the window that slides around, 60° wide.
const WINDOW: usize = 12;

/// Weights of the wavelets, and the constants they come from.
#[derive(Debug, Clone)]
pub struct Orientation {
    weights: [[f32; SAMPLES]; SITES],
}

impl Orientation {
    /// A Gaussian of 2.5 s over a disc of 6 s, s the distance of the wavelets.
    pub fn new() -> Self {
        let mut weights = [[0.0; SAMPLES]; SITES];
        for (i, row) in weights.iter_mut().enumerate() {
            for (j, weight) in row.iter_mut().enumerate().take(SITES) {
                let square = (i as f32 - 6.0).powi(2) + (j as f32 - 6.0).powi(2);
                if square < 36.0 {
                    *weight = (-square / (2.0 * 2.5 * 2.5)).exp();
                }
            }
        }
        Self { weights }
    }

    /// The direction in which the most of the gradients within 60° of each other point [rad],
    /// from x towards y.
    #[inline(always)]
    pub fn of(&self, keypoint: &Keypoint, image: &Smoothed) -> f32 {
        let grid = Grid {
            centre: [keypoint.x, keypoint.y],
            step: [keypoint.scale / DIAMETER, 0.0],
            side: SAMPLES,
        };
        dominant(&self.histogram(&sample(image, &grid)))
    }

    /// Sums of the weighted wavelets (x, y) by direction; the first window is repeated at the end.
    #[inline(always)]
    fn histogram(&self, samples: &[[f32; SAMPLES]; SAMPLES]) -> [[f32; BINS + WINDOW]; 2] {
        let mut histogram = [[0.0; BINS + WINDOW]; 2];
        // Sums of four samples along x.
        let mut across = [[0.0; SAMPLES]; SAMPLES];
        for (across, s) in across.iter_mut().zip(samples) {
            for j in 0..SITES {
                across[j] = (s[j] + s[j + 1]) + (s[j + 2] + s[j + 3]);
            }
        }
        for (i, weights) in self.weights.iter().enumerate() {
            let (mut x, mut y) = ([0.0; SAMPLES], [0.0; SAMPLES]);
            let mut bins = [0_u32; SAMPLES];
            let mut down = [0.0; SAMPLES];
            for (j, down) in down.iter_mut().enumerate() {
                *down =
                    (samples[i][j] + samples[i + 1][j]) + (samples[i + 2][j] + samples[i + 3][j]);
            }
            for j in 0..SITES {
                let horizontal = (down[j + 2] + down[j + 3]) - (down[j] + down[j + 1]);
                let above = across[i][j] + across[i + 1][j];
                let vertical = (across[i + 2][j] + across[i + 3][j]) - above;
                x[j] = weights[j] * horizontal;
                y[j] = weights[j] * vertical;
            }
            for j in 0..SAMPLES {
                bins[j] = bin(x[j], y[j]);
            }
            for j in 0..SITES {
                let bin = bins[j] as usize % BINS;
                histogram[0][bin] += x[j];
                histogram[1][bin] += y[j];
            }
        }
        for sums in &mut histogram {
            sums.copy_within(..WINDOW, BINS);
        }
        histogram
    }
}

/// Direction of the largest sum over a window.
#[inline(always)]
fn dominant(histogram: &[[f32; BINS + WINDOW]; 2]) -> f32 {
    let mut windows = [[0.0; BINS]; 2];
    for (window, sums) in windows.iter_mut().zip(histogram) {
        for (i, sum) in window.iter_mut().enumerate() {
            for bin in &sums[i..i + WINDOW] {
                *sum += bin;
            }
        }
    }
    let mut best = (0.0, 0.0, 0.0);
    for (&x, &y) in windows[0].iter().zip(&windows[1]) {
        let square = x * x + y * y;
        if square > best.0 {
            best = (square, x, y);
        }
    }
    best.2.atan2(best.1)
}

/// The bin of a direction, 0 to 72 = 0, to within the 0.01 rad of a polynomial for the arc tangent.
#[inline(always)]
fn bin(x: f32, y: f32) -> u32 {
    let (small, large) = (x.abs().min(y.abs()), x.abs().max(y.abs()));
    let t = small / large.max(f32::MIN_POSITIVE);
    // Within 0.0015 rad of atan(t) on 0…1 (Rajan et al., IEEE Signal Processing Magazine 2006).
    let angle = t * (0.25 * PI + 0.273 * (1.0 - t));
    let angle = if y.abs() > x.abs() {
        FRAC_PI_2 - angle
    } else {
        angle
    };
    let angle = if x < 0.0 { PI - angle } else { angle };
    let angle = if y < 0.0 { 2.0 * PI - angle } else { angle };
    round(angle * (BINS as f32 / (2.0 * PI))).1
}
