//! Directions that the gradients around a keypoint prefer (Lowe, section 5).

use pulp::{Simd, WithSimd};

use super::gradient::GradientPlane;
use super::sampling::{gradients, polar};

/// Most orientations of one keypoint.
pub const MAX_ORIENTATIONS: usize = 4;
/// Bins of the histogram of directions.
const BINS: usize = 36;
/// Samples of [`OrientationPattern`].
const SAMPLES: usize = 112;
/// Samples are taken up to this far away [σ of the keypoint]: three σ of the window.
const REACH: f32 = 4.5;
/// σ of the window [σ of the keypoint].
const WINDOW: f32 = 1.5;
/// A peak counts from this share of the highest one.
const PEAK_RATIO: f32 = 0.8;

/// Where gradients are looked up, in units of the keypoint's σ, and their weights.
#[derive(Debug)]
pub struct OrientationPattern {
    x: [f32; SAMPLES],
    y: [f32; SAMPLES],
    weight: [f32; SAMPLES],
}

impl Default for OrientationPattern {
    /// A sunflower (Vogel, Mathematical Biosciences 1979): as dense everywhere, and without the
    /// preferred directions of a square grid, which would show around blobs.
    fn default() -> Self {
        let golden_angle = std::f32::consts::PI * (3.0 - 5f32.sqrt());
        let place = |k: usize| {
            let radius = REACH * ((k as f32 + 0.5) / SAMPLES as f32).sqrt();
            let (sine, cosine) = (k as f32 * golden_angle).sin_cos();
            (radius * cosine, radius * sine)
        };
        Self {
            x: std::array::from_fn(|k| place(k).0),
            y: std::array::from_fn(|k| place(k).1),
            weight: std::array::from_fn(|k| {
                let (x, y) = place(k);
                (-(x * x + y * y) / (2.0 * WINDOW * WINDOW)).exp()
            }),
        }
    }
}

/// Orientations of one keypoint [rad], strongest bins in no order.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Orientations {
    angles: [f32; MAX_ORIENTATIONS],
    count: usize,
}

impl Orientations {
    /// The angles from x towards y [rad], 0 to 2π.
    pub fn as_slice(&self) -> &[f32] {
        &self.angles[..self.count]
    }
}

/// Finds the orientations of a keypoint.
pub struct FindOrientations<'a> {
    /// Where to look.
    pub pattern: &'a OrientationPattern,
    /// Gradients of the keypoint's level.
    pub plane: &'a GradientPlane,
    /// Column and row [px of the plane].
    pub center: (f32, f32),
    /// Scale of the keypoint [px of the plane].
    pub sigma: f32,
}

impl WithSimd for FindOrientations<'_> {
    type Output = Orientations;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Orientations {
        let pattern = self.pattern;
        let (mut xs, mut ys) = ([0.0; SAMPLES], [0.0; SAMPLES]);
        for k in 0..SAMPLES {
            xs[k] = self.sigma.mul_add(pattern.x[k], self.center.0);
            ys[k] = self.sigma.mul_add(pattern.y[k], self.center.1);
        }
        let (dx, dy) = gradients(self.plane, &xs, &ys);
        let (mut bins, mut weights) = ([0.0; SAMPLES], [0.0; SAMPLES]);
        for k in 0..SAMPLES {
            let (turns, length) = polar(dx[k], dy[k]);
            bins[k] = turns * BINS as f32;
            weights[k] = length * pattern.weight[k];
        }
        peaks(&smoothed(&histogram(&bins, &weights)))
    }
}

/// Sums of weights, each shared between the two bins next to its direction.
#[inline(always)]
fn histogram(bins: &[f32; SAMPLES], weights: &[f32; SAMPLES]) -> [f32; BINS] {
    // Two more bins than there are, for a full turn and its neighbour.
    let mut sums = [0.0; BINS + 2];
    for (&bin, &weight) in bins.iter().zip(weights) {
        let below = (bin as usize).min(BINS);
        let share = bin - below as f32;
        sums[below] += weight * (1.0 - share);
        sums[below + 1] += weight * share;
    }
    sums[0] += sums[BINS];
    sums[1] += sums[BINS + 1];
    std::array::from_fn(|b| sums[b])
}

/// A circular histogram filtered by (1, 4, 6, 4, 1) / 16.
#[inline(always)]
fn smoothed(sums: &[f32; BINS]) -> [f32; BINS] {
    let at = |b: usize, step: usize| sums[(b + BINS + step - 2) % BINS];
    std::array::from_fn(|b| {
        (at(b, 0) + at(b, 4) + 4.0 * (at(b, 1) + at(b, 3)) + 6.0 * at(b, 2)) / 16.0
    })
}

/// Peaks of a circular histogram, interpolated by a parabola.
fn peaks(sums: &[f32; BINS]) -> Orientations {
    let highest = sums.iter().fold(0.0f32, |high, &v| high.max(v));
    let mut found = Orientations::default();
    for (b, &value) in sums.iter().enumerate() {
        let (left, right) = (sums[(b + BINS - 1) % BINS], sums[(b + 1) % BINS]);
        let is_peak = value > left && value > right && value >= PEAK_RATIO * highest;
        if is_peak && found.count < MAX_ORIENTATIONS {
            let offset = 0.5 * (left - right) / (left - 2.0 * value + right);
            let turn = (b as f32 + offset) / BINS as f32;
            found.angles[found.count] = turn.rem_euclid(1.0) * std::f32::consts::TAU;
            found.count += 1;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_its_direction() {
        for degrees in [0.0f32, 3.0, 77.0, 181.0, 268.0, 359.0] {
            let (dy, dx) = degrees.to_radians().sin_cos();
            let word = ((dy * 4000.0).round() as i32) << 16 | ((dx * 4000.0) as i32 & 0xffff);
            let plane = GradientPlane {
                width: 64,
                height: 64,
                values: vec![word as u32; 64 * 64],
            };
            let found = pulp::Arch::new().dispatch(FindOrientations {
                pattern: &OrientationPattern::default(),
                plane: &plane,
                center: (31.3, 32.6),
                sigma: 2.2,
            });
            let [angle] = found.as_slice() else {
                panic!("one direction, got {found:?}");
            };
            let off = (angle.to_degrees() - degrees + 180.0).rem_euclid(360.0) - 180.0;
            // The histogram's bins are 10° wide.
            assert!(off.abs() <= 5.0, "{degrees}: {angle}");
        }
    }

    #[test]
    fn peaks_are_interpolated_and_weak_ones_left_out() {
        let mut sums = [0.0; BINS];
        sums[35] = 8.0;
        sums[0] = 10.0;
        sums[1] = 9.0;
        sums[10] = 8.5;
        sums[20] = 7.5;
        let found = peaks(&sums);
        let degrees: Vec<f32> = found.as_slice().iter().map(|a| a.to_degrees()).collect();
        // The vertex of the parabola through (-1, 8), (0, 10), (1, 9) is at 1/6.
        assert!((degrees[0] - 10.0 / 6.0).abs() < 1e-3, "{degrees:?}");
        assert!((degrees[1] - 100.0).abs() < 1e-3, "{degrees:?}");
        assert_eq!(degrees.len(), 2);
    }
}
