//! The image at several resolutions, as the means of boxes, to take descriptors from.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::hessian::BAND;
use super::integral::Integral;

/// Standard deviation [px] from which the first level is used; each next one from double that.
const FIRST_SIGMA: f32 = 1.6;
/// Sides of the boxes of a level, over the distance of its samples.
const BOXES: [usize; 2] = [2, 3];
/// Within a level the larger box is used from this standard deviation on, over that distance.
const LARGER_BOX_SIGMA: f32 = 2.5;

/// Fixed point of the samples: this many units a grey level.
#[cfg(test)]
const UNITS: f32 = 256.0;

/// Means of boxes, on a grid of samples.
#[derive(Debug, Clone, Default)]
pub struct Smoothed {
    /// Distance of neighbouring samples [px].
    pub step: f32,
    /// Pixel coordinate of the first sample, along both axes.
    pub origin: f32,
    /// Pairs of neighbouring samples a row.
    pub width: usize,
    /// Rows of samples.
    pub height: usize,
    /// A sample in the lower 16 bits and its right neighbour in the upper ones, row by row
    /// [1/256 grey levels]: interpolation needs both, and fetches them at once.
    pub pairs: Vec<u32>,
}

/// The images of all levels.
#[derive(Debug, Clone, Default)]
pub struct Pyramid {
    images: Vec<Smoothed>,
}

impl Pyramid {
    /// Takes the means of another image; memory is kept.
    pub fn compute(&mut self, integral: &Integral, levels: usize) {
        self.images
            .resize_with(levels * BOXES.len(), Smoothed::default);
        for (i, image) in self.images.iter_mut().enumerate() {
            fill(
                image,
                integral,
                1 << (i / BOXES.len()),
                BOXES[i % BOXES.len()],
            );
        }
    }

    /// The image for a neighbourhood whose samples lie `sigma` apart.
    pub fn at(&self, sigma: f32) -> &Smoothed {
        let levels = self.images.len() / BOXES.len();
        let mut level = 0;
        let mut relative = sigma;
        while relative >= 2.0 * FIRST_SIGMA && level + 1 < levels {
            relative *= 0.5;
            level += 1;
        }
        &self.images[level * BOXES.len() + usize::from(relative >= LARGER_BOX_SIGMA)]
    }
}

/// Means over boxes of side·step pixels, every `step` pixels.
fn fill(image: &mut Smoothed, integral: &Integral, step: usize, side: usize) {
    let samples = |pixels: usize| (pixels / step + 1).saturating_sub(side);
    image.step = step as f32;
    // The first box reaches from the image's corner, at -½, to side·step - ½.
    image.origin = 0.5 * (side * step) as f32 - 0.5;
    image.width = samples(integral.width()).saturating_sub(1);
    image.height = samples(integral.height());
    image.pairs.resize(image.width * image.height, 0);
    if image.width == 0 {
        return;
    }
    let width = image.width;
    let bands = image.pairs.par_chunks_mut(width * BAND).enumerate();
    bands.for_each(|(i, rows)| {
        Arch::new().dispatch(Band {
            rows,
            first: i * BAND,
            width,
            step,
            side,
            integral,
        });
    });
}

/// Consecutive rows of pairs, and what they are computed from.
struct Band<'a> {
    rows: &'a mut [u32],
    first: usize,
    width: usize,
    step: usize,
    side: usize,
    integral: &'a Integral,
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for (i, row) in self.rows.chunks_exact_mut(self.width).enumerate() {
            let y = (self.first + i) * self.step;
            let top = self.integral.row(y);
            let bottom = self.integral.row(y + self.side * self.step);
            match self.step {
                1 => means::<1>(top, bottom, self.side, row),
                2 => means::<2>(top, bottom, self.side, row),
                4 => means::<4>(top, bottom, self.side, row),
                8 => means::<8>(top, bottom, self.side, row),
                _ => means::<16>(top, bottom, self.side, row),
            }
        }
    }
}

/// A row of pairs.
#[inline(always)]
fn means<const STEP: usize>(top: &[i32], bottom: &[i32], side: usize, row: &mut [u32]) {
    let n = row.len();
    let length = n * STEP + 1;
    let (top_left, top_right) = (&top[..length], &top[side * STEP..][..length]);
    let (bottom_left, bottom_right) = (&bottom[..length], &bottom[side * STEP..][..length]);
    // Rounded down, so that the product, at most 255·2²⁴, fits.
    let factor = (1 << 24) / (side * STEP * side * STEP) as u32;
    let mean = |i: usize| {
        let bottom = bottom_right[i * STEP].wrapping_sub(bottom_left[i * STEP]);
        let top = top_right[i * STEP].wrapping_sub(top_left[i * STEP]);
        (bottom.wrapping_sub(top) as u32).wrapping_mul(factor) >> 16
    };
    for (i, pair) in row.iter_mut().enumerate() {
        *pair = mean(i);
    }
    let last = mean(n);
    for i in 0..n - 1 {
        row[i] |= row[i + 1] << 16;
    }
    row[n - 1] |= last << 16;
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::GrayImage;

    /// A grey ramp along both axes, of which the mean over a box is the value at its centre.
    #[test]
    fn samples_lie_where_they_are_said_to() {
        let (width, height) = (61, 47);
        let ramp = |x: f32, y: f32| 3.0 * x + 1.0 * y;
        let pixels: Vec<u8> = (0..width * height)
            .map(|i| ramp((i % width) as f32, (i / width) as f32) as u8)
            .collect();
        let mut integral = Integral::default();
        integral.compute(GrayImage::new(width, height, &pixels).unwrap());
        let mut pyramid = Pyramid::default();
        pyramid.compute(&integral, 4);
        let mut compared = 0;
        for image in &pyramid.images {
            for (i, &pair) in image.pairs.iter().enumerate() {
                let x = image.origin + image.step * (i % image.width) as f32;
                let y = image.origin + image.step * (i / image.width) as f32;
                for (value, x) in [(pair & 0xffff, x), (pair >> 16, x + image.step)] {
                    let value = value as f32 / UNITS;
                    assert!((value - ramp(x, y)).abs() < 0.01, "{x} {y} {value}");
                    compared += 1;
                }
            }
        }
        assert!(compared > 5000);
    }

    #[test]
    fn coarser_images_are_for_larger_neighbourhoods() {
        let mut pyramid = Pyramid::default();
        pyramid.compute(&Integral::default(), 3);
        let steps = [1.6, 3.1, 3.3, 6.3, 6.5, 40.0].map(|sigma| pyramid.at(sigma).step);
        assert_eq!(steps, [1.0, 1.0, 2.0, 2.0, 4.0, 4.0]);
    }
}
