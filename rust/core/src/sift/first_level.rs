//! The first level of the first octave, row by row from the image.

use pulp::Simd;

use super::convolve::BLOCK;
use super::kernel::FirstKernel;
use super::ring::RowRing;
use super::simd::{load, store};
use crate::GrayImage;

/// Rows of the image after the filter along x.
#[derive(Debug, Default)]
pub struct FirstLevel {
    filtered: RowRing,
    /// The next row of the image to be filtered.
    next: usize,
    /// One row of the image with its border.
    padded: Vec<f32>,
    /// The same row filtered by each phase.
    phases: Vec<Vec<f32>>,
}

/// Most taps of a phase: σ = 3.2 without doubling has 21.
const MAX_TAPS: usize = 32;

impl FirstLevel {
    /// Room for an image of `width` [px].
    pub fn new(kernel: &FirstKernel, width: usize) -> Self {
        let length = width.next_multiple_of(BLOCK) * kernel.factor();
        Self {
            filtered: RowRing::new(2 * kernel.reach() + 1, length),
            next: 0,
            padded: vec![0.0; width.next_multiple_of(BLOCK) + 2 * kernel.reach()],
            phases: vec![vec![0.0; width.next_multiple_of(BLOCK)]; kernel.factor()],
        }
    }

    /// Begins with what output row y needs.
    pub fn start(&mut self, kernel: &FirstKernel, y: usize) {
        self.next = (y / kernel.factor()).saturating_sub(kernel.reach());
    }

    /// Output row y, which must not be above one asked for since [`Self::start`].
    #[inline(always)]
    pub fn row<S: Simd>(
        &mut self,
        simd: S,
        kernel: &FirstKernel,
        image: GrayImage,
        y: usize,
        out: &mut [f32],
    ) {
        let (center, last) = (y / kernel.factor(), image.height() - 1);
        while self.next <= (center + kernel.reach()).min(last) {
            self.filter(simd, kernel, image, self.next);
            self.next += 1;
        }
        let phase = &kernel.phases[y % kernel.factor()];
        let mut inputs = [&[] as &[f32]; MAX_TAPS];
        let inputs = &mut inputs[..phase.taps.len()];
        for (input, k) in inputs.iter_mut().zip(phase.offset..) {
            *input = self.filtered.row(center.saturating_add_signed(k).min(last));
        }
        for x in (0..out.len()).step_by(S::F32_LANES) {
            let mut sum = simd.splat_f32s(0.0);
            for (&tap, input) in phase.taps.iter().zip(&*inputs) {
                sum = simd.mul_add_f32s(simd.splat_f32s(tap), load::<S>(input, x), sum);
            }
            store::<S>(out, x, sum);
        }
    }

    /// Filters row y of the image along x.
    #[inline(always)]
    fn filter<S: Simd>(&mut self, simd: S, kernel: &FirstKernel, image: GrayImage, y: usize) {
        let (reach, width) = (kernel.reach(), image.width());
        for (value, &pixel) in self.padded[reach..].iter_mut().zip(image.row(y)) {
            *value = f32::from(pixel);
        }
        let (first, last) = (self.padded[reach], self.padded[reach + width - 1]);
        self.padded[..reach].fill(first);
        self.padded[reach + width..].fill(last);
        let out = self.filtered.row_mut(y);
        for (phase, row) in kernel.phases.iter().zip(&mut self.phases) {
            let start = reach.saturating_add_signed(phase.offset);
            for x in (0..row.len()).step_by(S::F32_LANES) {
                let mut sum = simd.splat_f32s(0.0);
                for (&tap, x) in phase.taps.iter().zip(start + x..) {
                    let input = load::<S>(&self.padded, x);
                    sum = simd.mul_add_f32s(simd.splat_f32s(tap), input, sum);
                }
                store::<S>(row, x, sum);
            }
        }
        match self.phases.as_slice() {
            [even, odd] => {
                for ((pair, &a), &b) in out.as_chunks_mut().0.iter_mut().zip(even).zip(odd) {
                    *pair = [a, b];
                }
            }
            phases => out[..width].copy_from_slice(&phases[0][..width]),
        }
    }
}
