//! Descriptors from sums of Haar wavelets (Bay et al., section 4.2), as bytes.

use std::ops::Range;

use super::patch::{Grid, round, sample};
use super::smoothed::Smoothed;
use crate::Keypoint;

/// Wavelets along the side of the neighbourhood, one every s.
const SITES: usize = 20;
/// Samples along its side: a wavelet looks at two by two, one on either side of its centre.
const SAMPLES: usize = 21;
/// Wavelets of a row with those that only fill up a vector.
const LANES: usize = 24;
/// Fields along the side of the neighbourhood.
const FIELDS: usize = 4;
/// Side of the neighbourhood over s.
pub const DIAMETER: f32 = SITES as f32;

/// Units of a byte that a number of 1 has, in a descriptor of length 1.
const GAIN: f32 = 127.0;
/// The byte of zero.
const ZERO: f32 = 64.0;
/// The largest byte: products of two fit 16 bits in pairs.
const LARGEST: f32 = 127.0;

/// Numbers a field: sums of the derivatives and of their absolute values, split by the sign of the
/// other derivative where the descriptor is extended.
const CHANNELS: usize = 4;
const EXTENDED_CHANNELS: usize = 8;

type Rows = [[f32; LANES]; SITES];

/// Weights of the wavelets.
#[derive(Debug, Clone)]
pub struct Descriptor {
    /// Of each row or column of wavelets for each field: a Gaussian times the share of the field.
    weights: [[f32; LANES]; FIELDS],
}

impl Descriptor {
    /// A Gaussian of 3.3 s, each wavelet shared by the fields whose centres are nearest, linearly.
    pub fn new() -> Self {
        let mut weights = [[0.0; LANES]; FIELDS];
        let width = (SITES / FIELDS) as f32;
        for (field, weights) in weights.iter_mut().enumerate() {
            let centre = width * (field as f32 - 0.5 * (FIELDS - 1) as f32);
            for (site, weight) in weights.iter_mut().enumerate().take(SITES) {
                let position = site as f32 - 0.5 * (SITES - 1) as f32;
                let share = (1.0 - (position - centre).abs() / width).max(0.0);
                *weight = share * (-position * position / (2.0 * 3.3 * 3.3)).exp();
            }
        }
        Self { weights }
    }

    /// Describes a neighbourhood of 20 s × 20 s along the keypoint's orientation by 64 or 128 bytes.
    #[inline(always)]
    pub fn describe(&self, keypoint: &Keypoint, image: &Smoothed, bytes: &mut [u8]) {
        let (sine, cosine) = keypoint.angle.sin_cos();
        let step = keypoint.scale / DIAMETER;
        let grid = Grid {
            centre: [keypoint.x, keypoint.y],
            step: [step * cosine, step * sine],
            side: SAMPLES,
        };
        // One row more, as the last lane of a row looks one sample further.
        let samples = sample::<LANES, { SAMPLES + 1 }>(image, &grid);
        let samples = samples.as_flattened();
        let (mut x, mut y) = ([[0.0; LANES]; SITES], [[0.0; LANES]; SITES]);
        for i in 0..SITES {
            let above = &samples[i * LANES..][..LANES + 1];
            let below = &samples[(i + 1) * LANES..][..LANES + 1];
            for j in 0..LANES {
                let (falling, rising) = (below[j + 1] - above[j], above[j + 1] - below[j]);
                x[i][j] = falling + rising;
                y[i][j] = falling - rising;
            }
        }
        if bytes.len() == FIELDS * FIELDS * CHANNELS {
            self.sum_up::<CHANNELS>(&plain(&x, &y), bytes);
        } else {
            self.sum_up::<EXTENDED_CHANNELS>(&extended(&x, &y), bytes);
        }
    }

    /// Weighted sums over the fields, and their signed roots as bytes.
    #[inline(always)]
    fn sum_up<const N: usize>(&self, channels: &[Rows; N], bytes: &mut [u8]) {
        let mut sums = [[[0.0_f32; N]; FIELDS]; FIELDS];
        for (field, (weights, sums)) in self.weights.iter().zip(&mut sums).enumerate() {
            let support = support(field);
            for (c, rows) in channels.iter().enumerate() {
                let mut down = [[0.0_f32; 8]; LANES / 8];
                for (weight, row) in weights[support.clone()].iter().zip(&rows[support.clone()]) {
                    for (down, values) in down.iter_mut().zip(row.as_chunks::<8>().0) {
                        for (sum, value) in down.iter_mut().zip(values) {
                            *sum += weight * value;
                        }
                    }
                }
                for (sums, weights) in sums.iter_mut().zip(&self.weights) {
                    sums[c] = dot(down.as_flattened(), weights);
                }
            }
        }
        let numbers = sums.as_flattened().as_flattened();
        let sum: f32 = numbers.iter().map(|v| v.abs()).sum();
        let scale = 1.0 / sum.max(f32::MIN_POSITIVE);
        for (byte, number) in bytes.iter_mut().zip(numbers) {
            let root = (number.abs() * scale).sqrt().copysign(*number);
            *byte = round((root * GAIN + ZERO).clamp(0.0, LARGEST)).1 as u8;
        }
    }
}

/// The rows or columns of wavelets that count for a field.
#[inline(always)]
fn support(field: usize) -> Range<usize> {
    let width = SITES / FIELDS;
    let middle = field * width + width / 2;
    middle.saturating_sub(width - 1)..(middle + width).min(SITES)
}

/// Derivatives and their absolute values.
#[inline(always)]
fn plain(x: &Rows, y: &Rows) -> [Rows; CHANNELS] {
    [
        *x,
        *y,
        x.map(|row| row.map(f32::abs)),
        y.map(|row| row.map(f32::abs)),
    ]
}

/// The same where the other derivative is negative, then where it is not.
#[inline(always)]
fn extended(x: &Rows, y: &Rows) -> [Rows; EXTENDED_CHANNELS] {
    let mut channels = [[[0.0; LANES]; SITES]; EXTENDED_CHANNELS];
    for i in 0..SITES {
        for j in 0..LANES {
            let (x, y) = (x[i][j], y[i][j]);
            let (x_low, y_low) = (if y < 0.0 { x } else { 0.0 }, if x < 0.0 { y } else { 0.0 });
            let (x_high, y_high) = (x - x_low, y - y_low);
            channels[0][i][j] = x_low;
            channels[1][i][j] = y_low;
            channels[2][i][j] = x_low.abs();
            channels[3][i][j] = y_low.abs();
            channels[4][i][j] = x_high;
            channels[5][i][j] = y_high;
            channels[6][i][j] = x_high.abs();
            channels[7][i][j] = y_high.abs();
        }
    }
    channels
}

/// Sums eight lanes side by side first, in an order that does not depend on the machine.
#[inline(always)]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut lanes = [0.0; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    let pairs = [
        lanes[0] + lanes[4],
        lanes[1] + lanes[5],
        lanes[2] + lanes[6],
        lanes[3] + lanes[7],
    ];
    (pairs[0] + pairs[2]) + (pairs[1] + pairs[3])
}
