//! The first level of the first octave, row by row from the image.

use super::convolve::BLOCK;
use super::kernel::{FirstKernel, Phase};
use super::ring::RowRing;
use crate::GrayImage;

/// Rows of the image after the filter along x.
#[derive(Debug, Default)]
pub struct FirstLevel {
    filtered: RowRing,
    /// The next row of the image to be filtered.
    next: usize,
    /// One row of the image with its border.
    padded: Vec<f32>,
}

impl FirstLevel {
    /// Room for an image of `width` [px].
    pub fn new(kernel: &FirstKernel, width: usize) -> Self {
        let length = (width * kernel.factor()).next_multiple_of(BLOCK);
        Self {
            filtered: RowRing::new(2 * kernel.reach() + 1, length),
            next: 0,
            padded: vec![0.0; width + 2 * kernel.reach()],
        }
    }

    /// Begins with what output row y needs.
    pub fn start(&mut self, kernel: &FirstKernel, y: usize) {
        self.next = (y / kernel.factor()).saturating_sub(kernel.reach());
    }

    /// Output row y, which must not be above one asked for since [`Self::start`].
    #[inline(always)]
    pub fn row(&mut self, kernel: &FirstKernel, image: GrayImage, y: usize, out: &mut [f32]) {
        let (center, last) = (y / kernel.factor(), image.height() - 1);
        while self.next <= (center + kernel.reach()).min(last) {
            self.filter(kernel, image, self.next);
            self.next += 1;
        }
        let phase = &kernel.phases[y % kernel.factor()];
        out.fill(0.0);
        for (&tap, k) in phase.taps.iter().zip(phase.offset..) {
            let input = self.filtered.row(center.saturating_add_signed(k).min(last));
            for (sum, &value) in out.iter_mut().zip(input) {
                *sum = tap.mul_add(value, *sum);
            }
        }
    }

    /// Filters row y of the image along x.
    #[inline(always)]
    fn filter(&mut self, kernel: &FirstKernel, image: GrayImage, y: usize) {
        let (reach, width) = (kernel.reach(), image.width());
        let pixels = image.row(y);
        for (value, &pixel) in self.padded[reach..].iter_mut().zip(pixels) {
            *value = f32::from(pixel);
        }
        let (first, last) = (self.padded[reach], self.padded[reach + width - 1]);
        self.padded[..reach].fill(first);
        self.padded[reach + width..].fill(last);
        let out = self.filtered.row_mut(y);
        match kernel.phases.as_slice() {
            [even, odd] => {
                for (x, pair) in out[..2 * width].as_chunks_mut().0.iter_mut().enumerate() {
                    *pair = [
                        sum(even, &self.padded, x + reach),
                        sum(odd, &self.padded, x + reach),
                    ];
                }
            }
            phases => {
                for (x, value) in out[..width].iter_mut().enumerate() {
                    *value = sum(&phases[0], &self.padded, x + reach);
                }
            }
        }
    }
}

/// One value of a phase at input `x`.
#[inline(always)]
fn sum(phase: &Phase, row: &[f32], x: usize) -> f32 {
    let start = x.wrapping_add_signed(phase.offset);
    let inputs = &row[start..start + phase.taps.len()];
    phase
        .taps
        .iter()
        .zip(inputs)
        .fold(0.0, |sum, (&tap, &value)| tap.mul_add(value, sum))
}
