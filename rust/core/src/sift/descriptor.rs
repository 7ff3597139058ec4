//! Descriptors: histograms of gradients around a keypoint (Lowe, section 6), as RootSIFT
//! (Arandjelović & Zisserman, CVPR 2012).
//!
//! Gradients are looked up on a grid that turns and grows with the keypoint, as Lowe describes it,
//! instead of at every pixel: the level is as smooth as the keypoint's σ, and samples are one σ
//! apart. The weights of a sample are then the same for all keypoints.

use pulp::{Simd, WithSimd};

use super::gradient::GradientPlane;
use super::sampling::{gradients, polar};

/// Values of a descriptor: 4 × 4 places of 8 directions each.
pub const LENGTH: usize = PLACES * PLACES * DIRECTIONS;
/// Unit vectors are stored in these units, as bytes…
pub const UNITS: f32 = 255.0;
/// …of at most this value: 7 bits, so that sums of two products fit 16.
pub const MAX_VALUE: f32 = 127.0;

/// Places along each axis.
const PLACES: usize = 4;
/// Directions at each place.
const DIRECTIONS: usize = 8;
/// Distance between places [σ of the keypoint].
const PLACE_SPACING: f32 = 3.0;
/// Samples from one place to the next.
const PER_PLACE: usize = 3;
/// Samples along each axis: also half a place's spacing beyond the outer places.
const SIDE: usize = (PLACES + 1) * PER_PLACE;
/// Samples in all, filled up to whole vectors by ones without weight.
const SAMPLES: usize = (SIDE * SIDE).next_multiple_of(16);
/// σ of the window [distances between places]: half the width of the descriptor.
const WINDOW: f32 = 0.5 * PLACES as f32;
/// No value may be a larger share of the vector's length (Lowe, section 6.1).
const CLIP: f32 = 0.2;

/// Where gradients are looked up, in units of the keypoint's σ, and their weights.
#[derive(Debug)]
pub struct DescriptorPattern {
    x: [f32; SAMPLES],
    y: [f32; SAMPLES],
    weight: [f32; SAMPLES],
}

impl Default for DescriptorPattern {
    fn default() -> Self {
        // In distances between places, from the middle of the descriptor.
        let along = |i: usize| (i as f32 - 0.5 * (SIDE - 1) as f32) / PER_PLACE as f32;
        let window = |u: f32| (-u * u / (2.0 * WINDOW * WINDOW)).exp();
        Self {
            x: std::array::from_fn(|k| PLACE_SPACING * along(k % SIDE)),
            y: std::array::from_fn(|k| PLACE_SPACING * along(k / SIDE)),
            weight: std::array::from_fn(|k| match k / SIDE {
                ..SIDE => window(along(k % SIDE)) * window(along(k / SIDE)),
                _ => 0.0,
            }),
        }
    }
}

/// Describes the neighbourhood of a keypoint.
pub struct Describe<'a> {
    /// Where to look.
    pub pattern: &'a DescriptorPattern,
    /// Gradients of the keypoint's level.
    pub plane: &'a GradientPlane,
    /// Column and row [px of the plane].
    pub center: (f32, f32),
    /// Scale of the keypoint [px of the plane].
    pub sigma: f32,
    /// Orientation [rad].
    pub angle: f32,
    /// Where the descriptor goes to.
    pub out: &'a mut [u8; LENGTH],
}

impl WithSimd for Describe<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (directions, magnitudes) = self.samples();
        let mut sums = [[0.0; DIRECTIONS * PLACES]; PLACES];
        for (j, (t, m)) in directions
            .as_chunks::<SIDE>()
            .0
            .iter()
            .zip(magnitudes.as_chunks::<SIDE>().0)
            .take(SIDE)
            .enumerate()
        {
            let row = pool_row(t, m);
            let (place, share) = (j / PER_PLACE, share(j % PER_PLACE));
            if place > 0 {
                add(&mut sums[place - 1], &row, 1.0 - share);
            }
            if place < PLACES {
                add(&mut sums[place], &row, share);
            }
        }
        quantise(sums.as_flattened(), self.out);
    }
}

impl Describe<'_> {
    /// Direction relative to the keypoint's [eighths of a turn] and weighted length of the
    /// gradient at each sample.
    #[inline(always)]
    fn samples(&self) -> ([f32; SAMPLES], [f32; SAMPLES]) {
        let (sine, cosine) = self.angle.sin_cos();
        let (s, c) = (sine * self.sigma, cosine * self.sigma);
        let pattern = self.pattern;
        let (mut xs, mut ys) = ([0.0; SAMPLES], [0.0; SAMPLES]);
        for k in 0..SAMPLES {
            let (u, v) = (pattern.x[k], pattern.y[k]);
            xs[k] = c.mul_add(u, (-s).mul_add(v, self.center.0));
            ys[k] = s.mul_add(u, c.mul_add(v, self.center.1));
        }
        let (dx, dy) = gradients(self.plane, &xs, &ys);
        let (mut directions, mut magnitudes) = ([0.0; SAMPLES], [0.0; SAMPLES]);
        for k in 0..SAMPLES {
            let along = cosine.mul_add(dx[k], sine * dy[k]);
            let across = cosine.mul_add(dy[k], -sine * dx[k]);
            let (turns, length) = polar(along, across);
            directions[k] = turns * DIRECTIONS as f32;
            magnitudes[k] = length * pattern.weight[k];
        }
        (directions, magnitudes)
    }
}

/// Share of a sample, the i-th after a place, that goes to the next place.
#[inline(always)]
fn share(i: usize) -> f32 {
    (i as f32 + 0.5) / PER_PLACE as f32
}

/// Histograms of one row of samples, at its places.
#[inline(always)]
fn pool_row(directions: &[f32; SIDE], magnitudes: &[f32; SIDE]) -> [f32; DIRECTIONS * PLACES] {
    let mut sums = [[0.0; DIRECTIONS]; PLACES];
    for place in 0..=PLACES {
        let (mut before, mut after) = ([0.0f32; DIRECTIONS], [0.0f32; DIRECTIONS]);
        for i in 0..PER_PLACE {
            let k = place * PER_PLACE + i;
            let (t, m) = (directions[k], magnitudes[k]);
            for d in 0..DIRECTIONS {
                let off = (t - d as f32).abs();
                let around = DIRECTIONS as f32 - off;
                let off = if off < around { off } else { around };
                let near = 1.0 - off;
                let value = if near > 0.0 { near * m } else { 0.0 };
                before[d] = value.mul_add(1.0 - share(i), before[d]);
                after[d] = value.mul_add(share(i), after[d]);
            }
        }
        if place > 0 {
            add(&mut sums[place - 1], &before, 1.0);
        }
        if place < PLACES {
            add(&mut sums[place], &after, 1.0);
        }
    }
    let mut flat = [0.0; DIRECTIONS * PLACES];
    flat.copy_from_slice(sums.as_flattened());
    flat
}

#[inline(always)]
fn add<const N: usize>(sums: &mut [f32; N], values: &[f32; N], factor: f32) {
    for (sum, &value) in sums.iter_mut().zip(values) {
        *sum = value.mul_add(factor, *sum);
    }
}

/// Clips, normalises and takes the root; all zeros stay so.
#[inline(always)]
fn quantise(sums: &[f32], out: &mut [u8; LENGTH]) {
    let limit = CLIP * sums.iter().map(|v| v * v).sum::<f32>().sqrt();
    let clip = |v: f32| if v < limit { v } else { limit };
    let total: f32 = sums.iter().map(|&v| clip(v)).sum();
    let scale = UNITS * UNITS / (total + f32::MIN_POSITIVE);
    for (byte, &value) in out.iter_mut().zip(sums) {
        let root = (clip(value) * scale).sqrt() + 0.5;
        *byte = if root < MAX_VALUE { root } else { MAX_VALUE } as u8;
    }
}
