//! Determinants of the Hessian from box filters (Bay et al., CVIU 2008, sections 3.2 and 3.3).

use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::integral::Integral;

/// Rows of a band: the unit of parallel work.
pub const BAND: usize = 16;
/// Squared weight of the mixed derivative, which makes up for boxes in place of Gaussians.
const MIXED_WEIGHT: f32 = 0.9 * 0.9;

/// Determinants of the Hessian over a grid of pixels, one layer a filter size.
#[derive(Debug, Clone, Default)]
pub struct Octave {
    /// Distance of neighbouring grid points [px].
    pub step: usize,
    /// Grid points a row; point (column, row) is the pixel (column·step, row·step).
    pub columns: usize,
    /// Rows of the grid.
    pub rows: usize,
    /// Side of each layer's filter [px], ascending by one increment.
    pub sizes: Vec<usize>,
    /// Determinants of each layer, row by row; unspecified where the filter leaves the image.
    pub layers: Vec<Vec<f32>>,
}

impl Octave {
    /// Where the filter of a layer lies within the image, along an axis of that many pixels.
    pub fn valid(&self, layer: usize, pixels: usize) -> Range<usize> {
        valid(self.sizes[layer], self.step, pixels)
    }
}

/// Partial sums along columns, for one row of a band.
#[derive(Debug, Clone, Default)]
pub struct ColumnSums {
    xx: Vec<i32>,
    yy: Vec<i32>,
    xy: Vec<i32>,
}

/// Side of the filter [px] of a layer: 9, 15, 21, 27 in the first octave, 15, 27, 39, 51 in the
/// second, and so on.
pub fn filter_size(octave: usize, layer: usize) -> usize {
    3 * ((1 << (octave + 1)) * (layer + 1) + 1)
}

/// Fills an octave; `finer` is the octave before it, some of whose layers are shared.
pub fn compute(
    integral: &Integral,
    octave: &mut Octave,
    finer: Option<&Octave>,
    scratch: &mut Vec<ColumnSums>,
) {
    let step = octave.step;
    octave.columns = integral.width().div_ceil(step);
    octave.rows = integral.height().div_ceil(step);
    let corners = integral.width() + 1;
    let bands = octave.rows.div_ceil(BAND);
    scratch.resize_with(bands.max(scratch.len()), ColumnSums::default);
    for sums in scratch.iter_mut() {
        sums.xx.resize(corners, 0);
        sums.yy.resize(corners, 0);
        sums.xy.resize(corners, 0);
    }
    if octave.columns == 0 {
        return;
    }
    for (&size, plane) in octave.sizes.iter().zip(&mut octave.layers) {
        plane.resize(octave.columns * octave.rows, 0.0);
        let shared = finer.and_then(|f| Some((f, f.sizes.iter().position(|&s| s == size)?)));
        if let Some((finer, layer)) = shared {
            subsample(plane, octave.columns, finer, layer);
            continue;
        }
        let bands = plane.par_chunks_mut(octave.columns * BAND).enumerate();
        bands.zip(&mut *scratch).for_each(|((i, rows), sums)| {
            Arch::new().dispatch(Band {
                rows,
                first: i * BAND,
                columns: octave.columns,
                step,
                size,
                integral,
                sums,
            });
        });
    }
}

/// Every other determinant of every other row of a finer octave.
fn subsample(plane: &mut [f32], columns: usize, finer: &Octave, layer: usize) {
    let rows = plane.par_chunks_exact_mut(columns).enumerate();
    rows.for_each(|(i, row)| {
        let source = &finer.layers[layer][2 * i * finer.columns..][..finer.columns];
        for (value, source) in row.iter_mut().zip(source.chunks(2)) {
            *value = source[0];
        }
    });
}

/// Consecutive rows of a layer, and what their determinants are computed from.
struct Band<'a> {
    rows: &'a mut [f32],
    first: usize,
    columns: usize,
    step: usize,
    size: usize,
    integral: &'a Integral,
    sums: &'a mut ColumnSums,
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (step, size, sums) = (self.step, self.size, self.sums);
        let valid_rows = valid(size, step, self.integral.height());
        let valid_columns = valid(size, step, self.integral.width());
        if valid_columns.is_empty() {
            return;
        }
        let first = valid_columns.start;
        for (i, row) in self.rows.chunks_exact_mut(self.columns).enumerate() {
            if valid_rows.contains(&(self.first + i)) {
                sum_columns(self.integral, (self.first + i) * step, size, sums);
                let row = &mut row[valid_columns.clone()];
                match step {
                    1 => combine::<1>(sums, first, size, row),
                    2 => combine::<2>(sums, first, size, row),
                    4 => combine::<4>(sums, first, size, row),
                    8 => combine::<8>(sums, first, size, row),
                    _ => combine::<16>(sums, first, size, row),
                }
            }
        }
    }
}

/// The filters' sums along the columns of the image, for the pixels of row y.
///
/// With l a third of the filter's side: the filter for the second derivative along x are three
/// lobes side by side, each l wide and 2l - 1 high; the mixed one has four lobes of l × l around a
/// cross one pixel wide.
#[inline(always)]
fn sum_columns(integral: &Integral, y: usize, size: usize, sums: &mut ColumnSums) {
    let (lobe, half, middle) = (size / 3, size / 2, size / 6);
    let n = integral.width() + 1;
    let row = |y: usize| &integral.row(y)[..n];
    let (xx, yy, xy) = (&mut sums.xx[..n], &mut sums.yy[..n], &mut sums.xy[..n]);
    let (top, bottom) = (row(y + 1 - lobe), row(y + lobe));
    for c in 0..n {
        xx[c] = bottom[c].wrapping_sub(top[c]);
    }
    let (top, bottom) = (row(y - half), row(y + half + 1));
    let (inner_top, inner_bottom) = (row(y - middle), row(y + middle + 1));
    for c in 0..n {
        let inner = inner_bottom[c].wrapping_sub(inner_top[c]);
        yy[c] = bottom[c]
            .wrapping_sub(top[c])
            .wrapping_sub(inner.wrapping_mul(3));
    }
    let (upper_top, upper_bottom) = (row(y - lobe), row(y));
    let (lower_top, lower_bottom) = (row(y + 1), row(y + lobe + 1));
    for c in 0..n {
        let upper = upper_bottom[c].wrapping_sub(upper_top[c]);
        xy[c] = upper.wrapping_sub(lower_bottom[c].wrapping_sub(lower_top[c]));
    }
}

/// Determinants of the grid points from `first` on, from the sums along the columns.
#[inline(always)]
fn combine<const STEP: usize>(sums: &ColumnSums, first: usize, size: usize, row: &mut [f32]) {
    let (lobe, half, middle) = (size / 3, size / 2, size / 6);
    let (x, n) = (first * STEP, row.len());
    let scale = 1.0 / (size * size) as f32;
    let length = (n - 1) * STEP + 1;
    let outer = (
        &sums.xx[x - half..][..length],
        &sums.xx[x + half + 1..][..length],
    );
    let inner = (
        &sums.xx[x - middle..][..length],
        &sums.xx[x + middle + 1..][..length],
    );
    let yy = (
        &sums.yy[x + 1 - lobe..][..length],
        &sums.yy[x + lobe..][..length],
    );
    let left = (&sums.xy[x - lobe..][..length], &sums.xy[x..][..length]);
    let right = (
        &sums.xy[x + 1..][..length],
        &sums.xy[x + lobe + 1..][..length],
    );
    for (i, value) in row.iter_mut().enumerate() {
        let c = i * STEP;
        let inner = inner.1[c].wrapping_sub(inner.0[c]);
        let xx = outer.1[c]
            .wrapping_sub(outer.0[c])
            .wrapping_sub(inner.wrapping_mul(3));
        let yy = yy.1[c].wrapping_sub(yy.0[c]);
        let left = left.1[c].wrapping_sub(left.0[c]);
        let xy = left.wrapping_sub(right.1[c].wrapping_sub(right.0[c]));
        let (xx, yy, xy) = (xx as f32 * scale, yy as f32 * scale, xy as f32 * scale);
        *value = xx * yy - MIXED_WEIGHT * xy * xy;
    }
}

/// Grid points at which a filter lies within the image.
fn valid(size: usize, step: usize, pixels: usize) -> Range<usize> {
    let half = size / 2;
    if pixels < size {
        return 0..0;
    }
    half.div_ceil(step)..(pixels - 1 - half) / step + 1
}
