//! Separable convolution of four rows at a time.

use pulp::Simd;

use super::ring::RowRing;
use super::simd::{load, store};

/// Rows that are convolved together: each input row is loaded once for all of them.
pub const TILE: usize = 4;
/// Columns that are convolved together are two vectors; rows are padded to this many.
pub const BLOCK: usize = 32;
/// Largest radius of a kernel: that of the last level at σ = 3.2 with one scale an octave.
pub const MAX_RADIUS: usize = 67;
/// Values before the first column of a row of [`Tile`], for the kernel's left half.
const MARGIN: usize = 80;

/// A kernel with zeros around it.
#[derive(Debug, Clone)]
pub struct PaddedKernel {
    radius: usize,
    padded: Vec<f32>,
}

impl PaddedKernel {
    /// `taps` at -radius…radius, at most [`MAX_RADIUS`].
    pub fn new(taps: &[f32]) -> Self {
        let zeros = [0.0; TILE - 1];
        Self {
            radius: taps.len() / 2,
            padded: [&zeros, taps, &zeros].concat(),
        }
    }

    /// Farthest value that is looked at.
    pub fn radius(&self) -> usize {
        self.radius
    }

    /// The taps without the zeros.
    fn taps(&self) -> &[f32] {
        &self.padded[TILE - 1..self.padded.len() - (TILE - 1)]
    }
}

/// [`TILE`] rows between the vertical and the horizontal pass.
#[derive(Debug, Default)]
pub struct Tile {
    stride: usize,
    values: Vec<f32>,
}

impl Tile {
    /// Room for rows of `width` values.
    pub fn new(width: usize) -> Self {
        let stride = MARGIN + width.next_multiple_of(BLOCK) + MARGIN;
        Self {
            stride,
            values: vec![0.0; TILE * stride],
        }
    }

    #[inline(always)]
    fn rows(&self) -> [&[f32]; TILE] {
        std::array::from_fn(|q| &self.values[q * self.stride..(q + 1) * self.stride])
    }

    #[inline(always)]
    fn rows_mut(&mut self) -> [&mut [f32]; TILE] {
        let mut rows = self.values.chunks_exact_mut(self.stride.max(1));
        std::array::from_fn(|_| rows.next().unwrap_or_default())
    }
}

/// Convolves rows y…y + R - 1 of an image of `width` × `height`; outside it goes on as at its edge.
///
/// A row's result does not depend on the rows that it is computed with.
#[inline(always)]
pub fn convolve<S: Simd, const R: usize>(
    simd: S,
    kernel: &PaddedKernel,
    source: &RowRing,
    (width, height): (usize, usize),
    y: usize,
    tile: &mut Tile,
    target: &mut RowRing,
) {
    let mut inputs = [&[] as &[f32]; 2 * MAX_RADIUS + TILE];
    let count = 2 * kernel.radius + R;
    for (j, input) in inputs[..count].iter_mut().enumerate() {
        *input = source.row((y + j).saturating_sub(kernel.radius).min(height - 1));
    }
    vertical::<S, R>(simd, kernel, &inputs[..count], width, tile);
    for row in tile.rows_mut().into_iter().take(R) {
        let (first, last) = (row[MARGIN], row[MARGIN + width - 1]);
        row[MARGIN - kernel.radius..MARGIN].fill(first);
        row[MARGIN + width..MARGIN + width + kernel.radius].fill(last);
    }
    horizontal::<S, R>(simd, kernel, tile, width, y, target);
}

/// Weighted sums of rows: output q takes input j with weight j - q of the kernel.
#[inline(always)]
fn vertical<S: Simd, const R: usize>(
    simd: S,
    kernel: &PaddedKernel,
    inputs: &[&[f32]],
    width: usize,
    tile: &mut Tile,
) {
    let outputs = tile.rows_mut();
    let mut x = 0;
    while x < width {
        let mut sums = [[simd.splat_f32s(0.0); 2]; R];
        for (input, weights) in inputs.iter().zip(kernel.padded.windows(TILE)) {
            let a = load::<S>(input, x);
            let b = load::<S>(input, x + S::F32_LANES);
            for (q, sum) in sums.iter_mut().enumerate() {
                let weight = simd.splat_f32s(weights[TILE - 1 - q]);
                sum[0] = simd.mul_add_f32s(weight, a, sum[0]);
                sum[1] = simd.mul_add_f32s(weight, b, sum[1]);
            }
        }
        for q in 0..R {
            store::<S>(outputs[q], MARGIN + x, sums[q][0]);
            store::<S>(outputs[q], MARGIN + x + S::F32_LANES, sums[q][1]);
        }
        x += 2 * S::F32_LANES;
    }
}

/// Convolves the rows of the tile along x.
#[inline(always)]
fn horizontal<S: Simd, const R: usize>(
    simd: S,
    kernel: &PaddedKernel,
    tile: &Tile,
    width: usize,
    y: usize,
    target: &mut RowRing,
) {
    let inputs = tile.rows();
    let taps = kernel.taps();
    let start = MARGIN - kernel.radius;
    let mut x = 0;
    while x < width {
        let mut sums = [[simd.splat_f32s(0.0); 2]; R];
        for (j, &tap) in taps.iter().enumerate() {
            let weight = simd.splat_f32s(tap);
            for (sum, input) in sums.iter_mut().zip(inputs) {
                let a = load::<S>(input, start + x + j);
                let b = load::<S>(input, start + x + j + S::F32_LANES);
                sum[0] = simd.mul_add_f32s(weight, a, sum[0]);
                sum[1] = simd.mul_add_f32s(weight, b, sum[1]);
            }
        }
        for (q, sum) in sums.iter().enumerate() {
            let row = target.row_mut(y + q);
            store::<S>(row, x, sum[0]);
            store::<S>(row, x + S::F32_LANES, sum[1]);
        }
        x += 2 * S::F32_LANES;
    }
}
