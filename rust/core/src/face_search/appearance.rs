//! Does the face, where the homography puts it, look like its reference?

use nalgebra::{Matrix3, Vector2};

use crate::bilinear::{blend, pair};
use crate::{GrayImage, InputError};

/// Side of the compared image [px].
const SIDE: usize = 96;
/// Cells along it.
const CELLS: usize = 6;
/// Cells of the reference with less contrast [grey levels] than this say nothing.
const MIN_CONTRAST: f32 = 6.0;
/// Correlation above which a cell counts as seen.
const SEEN: f32 = 0.5;
/// An oblique or distant view has lost detail: both images are blurred to what both can show [px].
const BLUR: f32 = 1.5;
/// Taps on each side of the blur's middle.
const TAPS: usize = 5;

const CELL: usize = SIDE / CELLS;

/// A reference image prepared for comparison: squeezed into a square and blurred.
#[derive(Debug, Clone)]
pub struct Appearance {
    size: Vector2<f64>,
    /// Whole grey levels: rounding is a hundredth of the least contrast, squared.
    image: Vec<u8>,
}

impl Appearance {
    /// Prepares a reference image.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] where it has no pixels.
    pub fn new(reference: GrayImage<'_>) -> Result<Self, InputError> {
        for (name, value) in [
            ("reference width", reference.width()),
            ("reference height", reference.height()),
        ] {
            if value == 0 {
                return Err(InputError::OutOfRange {
                    name,
                    value: 0.0,
                    valid: "> 0",
                });
            }
        }
        Ok(Self {
            size: Vector2::new(reference.width() as f64, reference.height() as f64),
            image: blurred(&squeezed(reference))
                .into_iter()
                .map(|value| value.round() as u8)
                .collect(),
        })
    }

    /// Bytes that it occupies.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.image[..])
    }

    /// Share of the reference's textured cells that the frame shows, 0 … 1.
    ///
    /// Cells are compared by normalised cross-correlation, so lighting does not matter; a cell
    /// that is hidden or outside of the image counts as not seen.
    ///
    /// `homography`: from the reference's edge coordinates to pixels of the frame (undistorted).
    pub fn agreement(&self, frame: GrayImage<'_>, homography: &Matrix3<f64>) -> f64 {
        pulp::Arch::new().dispatch(Comparison {
            appearance: self,
            frame,
            homography,
        })
    }

    #[inline(always)]
    fn compare(&self, frame: GrayImage<'_>, homography: &Matrix3<f64>) -> f64 {
        let seen = blurred(&self.warped(frame, homography));
        let (mut textured, mut agreeing) = (0_usize, 0_usize);
        for cell in 0..CELLS * CELLS {
            let (reference, contrast) = centred(&self.image, cell);
            if contrast < MIN_CONTRAST {
                continue;
            }
            textured += 1;
            let (seen, seen_contrast) = centred(&seen, cell);
            let product = sum_of_products(&reference, &seen);
            let norm = contrast * seen_contrast * (CELL * CELL) as f32;
            if product >= SEEN * norm.max(1e-6) {
                agreeing += 1;
            }
        }
        agreeing as f64 / textured.max(1) as f64
    }

    /// The frame where the square's pixels lie, 0 outside of it.
    #[inline(always)]
    fn warped(&self, frame: GrayImage<'_>, homography: &Matrix3<f64>) -> Vec<f32> {
        let step = self.size / SIDE as f64;
        // Pixel centres of the square in the edge coordinates of the reference.
        let edge_from_square =
            Matrix3::new_nonuniform_scaling(&step) * Matrix3::new_translation(&[0.5, 0.5].into());
        let H = (homography * edge_from_square).map(|v| v as f32);
        let mut warped = vec![0.0; SIDE * SIDE];
        for (y, pixels) in warped.as_chunks_mut::<SIDE>().0.iter_mut().enumerate() {
            let row = H.column(1) * y as f32 + H.column(2);
            let (mut xs, mut ys) = ([0.0; SIDE], [0.0; SIDE]);
            for i in 0..SIDE {
                let x = i as f32;
                let inverse = 1.0 / (H[(2, 0)] * x + row[2]);
                xs[i] = (H[(0, 0)] * x + row[0]) * inverse;
                ys[i] = (H[(1, 0)] * x + row[1]) * inverse;
            }
            sample(frame, &xs, &ys, pixels);
        }
        warped
    }
}

/// A comparison to be compiled for each instruction set.
struct Comparison<'a> {
    appearance: &'a Appearance,
    frame: GrayImage<'a>,
    homography: &'a Matrix3<f64>,
}

impl pulp::NullaryFnOnce for Comparison<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        self.appearance.compare(self.frame, self.homography)
    }
}

/// Grey levels between pixel centres; 0 outside of the image, everywhere where that is one pixel wide or
/// high.
///
/// Only the pixels are read one by one, the rest is done several at a time.
#[inline(always)]
fn sample(image: GrayImage<'_>, xs: &[f32; SIDE], ys: &[f32; SIDE], out: &mut [f32; SIDE]) {
    let (width, height) = (image.width(), image.height());
    if width < 2 || height < 2 {
        return;
    }
    let (right, bottom) = (width as f32 - 1.0, height as f32 - 1.0);
    // At the last column and row the fraction is one.
    let (last_column, last_row) = (width as i32 - 2, height as i32 - 2);
    let (mut fx, mut fy, mut inside) = ([0.0; SIDE], [0.0; SIDE], [0.0; SIDE]);
    let (mut columns, mut rows) = ([0_i32; SIDE], [0_i32; SIDE]);
    for i in 0..SIDE {
        let (x, y) = (xs[i], ys[i]);
        let is_inside = (x >= 0.0) & (y >= 0.0) & (x <= right) & (y <= bottom);
        inside[i] = f32::from(u8::from(is_inside));
        // NaN becomes zero by `max`.
        let (x, y) = (x.max(0.0).min(right), y.max(0.0).min(bottom));
        let (column, row) = ((x as i32).min(last_column), (y as i32).min(last_row));
        fx[i] = x - column as f32;
        fy[i] = y - row as f32;
        (columns[i], rows[i]) = (column, row);
    }
    let (mut above, mut below) = ([0_u16; SIDE], [0_u16; SIDE]);
    for i in 0..SIDE {
        let first = rows[i] as usize * width + columns[i] as usize;
        above[i] = pair(image.pixels(), first);
        below[i] = pair(image.pixels(), first + width);
    }
    for i in 0..SIDE {
        let (upper, lower) = (blend(above[i], fx[i]), blend(below[i], fx[i]));
        out[i] = inside[i] * (upper + fy[i] * (lower - upper));
    }
}

/// The image as a square, each pixel the mean over its area.
fn squeezed(image: GrayImage<'_>) -> Vec<f32> {
    let (columns, rows) = (shares(image.width()), shares(image.height()));
    let mut narrow = vec![0.0_f32; SIDE * image.height()];
    for y in 0..image.height() {
        let line = image.row(y);
        for (x, share) in columns.iter().enumerate() {
            narrow[y * SIDE + x] = share.iter().map(|(i, w)| f32::from(line[*i]) * w).sum();
        }
    }
    let mut square = Vec::with_capacity(SIDE * SIDE);
    for share in &rows {
        for x in 0..SIDE {
            square.push(share.iter().map(|(i, w)| narrow[i * SIDE + x] * w).sum());
        }
    }
    square
}

/// For each of the square's columns (or rows), which of the image's it covers and by what share.
fn shares(length: usize) -> Vec<Vec<(usize, f32)>> {
    let step = length as f32 / SIDE as f32;
    (0..SIDE)
        .map(|i| {
            let (low, high) = (i as f32 * step, (i + 1) as f32 * step);
            (low as usize..length.min(high.ceil() as usize))
                .map(|j| {
                    let covered = high.min(j as f32 + 1.0) - low.max(j as f32);
                    (j, covered.max(0.0) / step)
                })
                .collect()
        })
        .collect()
}

/// Gaussian blur of a square, mirrored at its border.
#[inline(always)]
fn blurred(image: &[f32]) -> Vec<f32> {
    let weights = weights();
    let inside = |i: isize| i.unsigned_abs().min(2 * (SIDE - 1) - i.unsigned_abs());
    let mut across = vec![0.0_f32; SIDE * SIDE];
    for (row, out) in image.chunks_exact(SIDE).zip(across.chunks_exact_mut(SIDE)) {
        let mut padded = [0.0_f32; SIDE + 2 * TAPS];
        for (i, value) in padded.iter_mut().enumerate() {
            *value = row[inside(i as isize - TAPS as isize)];
        }
        for (tap, weight) in weights.iter().enumerate() {
            for (value, source) in out.iter_mut().zip(&padded[tap..]) {
                *value += weight * source;
            }
        }
    }
    let mut down = vec![0.0_f32; SIDE * SIDE];
    for (y, out) in down.chunks_exact_mut(SIDE).enumerate() {
        for (tap, weight) in weights.iter().enumerate() {
            let row = inside(y as isize + tap as isize - TAPS as isize) * SIDE;
            for (value, source) in out.iter_mut().zip(&across[row..row + SIDE]) {
                *value += weight * source;
            }
        }
    }
    down
}

fn weights() -> [f32; 2 * TAPS + 1] {
    let mut weights = [0.0_f32; 2 * TAPS + 1];
    for (i, weight) in weights.iter_mut().enumerate() {
        let x = (i as f32 - TAPS as f32) / BLUR;
        *weight = (-0.5 * x * x).exp();
    }
    let sum: f32 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

/// A cell's pixels about their mean, and their standard deviation.
#[inline(always)]
fn centred<T: Copy + Into<f32>>(image: &[T], cell: usize) -> ([f32; CELL * CELL], f32) {
    let first = (cell / CELLS) * CELL * SIDE + (cell % CELLS) * CELL;
    let mut values = [0.0_f32; CELL * CELL];
    for (row, out) in values.chunks_exact_mut(CELL).enumerate() {
        let pixels = &image[first + row * SIDE..first + row * SIDE + CELL];
        for (value, pixel) in out.iter_mut().zip(pixels) {
            *value = (*pixel).into();
        }
    }
    let mean = sum_of_products(&values, &[1.0; CELL * CELL]) / values.len() as f32;
    for value in &mut values {
        *value -= mean;
    }
    let variance = sum_of_products(&values, &values) / values.len() as f32;
    (values, variance.sqrt())
}

/// In [`CELL`] sums side by side, one for each column, so that a processor adds several at once.
#[inline(always)]
fn sum_of_products(a: &[f32; CELL * CELL], b: &[f32; CELL * CELL]) -> f32 {
    let mut sums = [0.0_f32; CELL];
    for (a, b) in a.chunks_exact(CELL).zip(b.chunks_exact(CELL)) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn grey_levels_lie_between_the_pixels_and_outside_of_the_image_there_are_none() {
        let pixels = [0, 10, 40, 80, 20, 60];
        let image = GrayImage::new(3, 2, &pixels).unwrap();
        let outside = [f32::NAN, f32::INFINITY, -1e-3, 2.001, -1e30, 1e30];
        let inside = [0.0, 0.5, 1.0, 1.25, 2.0];
        let value = |x: f32, y: f32| {
            let (column, row) = ((x as usize).min(1), 0);
            let (fx, fy) = (x - column as f32, y - row as f32);
            let at = |c: usize, r: usize| f32::from(pixels[3 * r + c]);
            let across = |r: usize| at(column, r) + fx * (at(column + 1, r) - at(column, r));
            across(0) + fy * (across(1) - across(0))
        };
        let sampled = |x: f32, y: f32| {
            let mut out = [0.0; SIDE];
            sample(image, &[x; SIDE], &[y; SIDE], &mut out);
            assert!(out.iter().all(|v| *v == out[0]));
            out[0]
        };
        for x in inside {
            for y in [0.0, 0.25, 1.0] {
                assert!((sampled(x, y) - value(x, y)).abs() < 1e-4, "{x} {y}");
            }
            for beyond in outside {
                assert_eq!(sampled(x, beyond), 0.0);
            }
        }
        for beyond in outside {
            assert_eq!(sampled(beyond, 0.5), 0.0);
        }
    }
}
