//! What the pixels of a tile see of the reference.
//!
//! A frame's pixel sees the mean over its footprint on the face. Where the face is oblique, that is
//! long and narrow: the pyramid level is that of its narrow side, and several samples are spread
//! along its long side (as in anisotropic texture filtering, McCormack et al., SIGGRAPH 1999).

use nalgebra::{Matrix2, Vector2};

use super::AlignmentReference;
use super::area::Level;
use super::tiles::{PIXELS, SIDE, Tile};
use super::view::View;
use crate::bilinear::{blend, pair};

/// Side of a tile with the border that its gradients need.
pub const BORDERED: usize = SIDE + 2;
/// Pixels of a bordered tile, with four to spare so that vectors of eight fill it.
pub const BORDERED_PIXELS: usize = (BORDERED * BORDERED).next_multiple_of(8);
/// Column and row of each pixel of a bordered tile.
const GRID: [[f32; BORDERED_PIXELS]; 2] = grid();
/// Samples along a footprint, at most.
const MOST_SAMPLES: f64 = 8.0;
/// A pixel counts if the reference covers it and its neighbours: half of three pixels.
const REACH: f64 = 1.5;
/// A tile's map into one level of the reference.
pub struct Footprint<'a> {
    level: &'a Level,
    /// Homography from the tile's bordered pixels to pixel coordinates of the level.
    map: [f32; 9],
    /// The step between samples along the footprint, in pixels of the level, and their number.
    step: [f32; 2],
    samples: usize,
    /// Range of pixel coordinates of the level in which footprints lie within the reference.
    low: [f32; 2],
    high: [f32; 2],
}

impl<'a> Footprint<'a> {
    pub fn new(tile: Tile, view: &View, reference: &'a AlignmentReference) -> Self {
        let scale = Matrix2::from_diagonal(&Vector2::from(reference.scale()));
        let J = scale * view.reference_jacobian(tile.centre());
        let (along, narrow) = axes(&J);
        let deepest = reference.levels().len() - 1;
        let index = (narrow.max(1e-9).log2().round().max(0.0) as usize).min(deepest);
        let shrink = 1.0 / (1u32 << index) as f64;
        let samples = (along.norm() * shrink).round().clamp(1.0, MOST_SAMPLES);
        let along = along * (shrink / samples);
        let level = &reference.levels()[index];
        let [sx, sy] = reference.scale().map(|s| s * shrink);
        let map = level_from_tile(view, tile, [sx, sy]);
        let reach =
            [0, 1].map(|axis| (REACH * shrink * (J[(axis, 0)].abs() + J[(axis, 1)].abs())) as f32);
        let size = [sx * reference.width(), sy * reference.height()].map(|s| s as f32);
        Self {
            level,
            map,
            step: [along.x as f32, along.y as f32],
            samples: samples as usize,
            low: reach.map(|r| r - 0.5),
            high: [0, 1].map(|axis| size[axis] - 0.5 - reach[axis]),
        }
    }

    /// Pixel coordinates of the level for all pixels of the bordered tile.
    #[inline(always)]
    pub fn positions(&self) -> ([f32; BORDERED_PIXELS], [f32; BORDERED_PIXELS]) {
        let (mut columns, mut rows) = ([0.0; BORDERED_PIXELS], [0.0; BORDERED_PIXELS]);
        let m = &self.map;
        for i in 0..BORDERED_PIXELS {
            let (x, y) = (GRID[0][i], GRID[1][i]);
            let w = 1.0 / (m[6] * x + m[7] * y + m[8]);
            columns[i] = (m[0] * x + m[1] * y + m[2]) * w;
            rows[i] = (m[3] * x + m[4] * y + m[5]) * w;
        }
        (columns, rows)
    }

    /// Means over the footprints.
    #[inline(always)]
    pub fn sample(
        &self,
        columns: &[f32; BORDERED_PIXELS],
        rows: &[f32; BORDERED_PIXELS],
    ) -> [f32; BORDERED_PIXELS] {
        let mut sums = [0.0; BORDERED_PIXELS];
        for sample in 0..self.samples {
            let offset = sample as f32 - 0.5 * (self.samples as f32 - 1.0);
            let moved = [offset * self.step[0], offset * self.step[1]];
            add_samples(self.level, columns, rows, moved, &mut sums);
        }
        let share = 1.0 / self.samples as f32;
        for sum in &mut sums {
            *sum *= share;
        }
        sums
    }

    /// One for the tile's pixels whose footprint and neighbours lie within the reference.
    #[inline(always)]
    pub fn mask(
        &self,
        columns: &[f32; BORDERED_PIXELS],
        rows: &[f32; BORDERED_PIXELS],
    ) -> [f32; PIXELS] {
        let (x, y) = (inner(columns, 0), inner(rows, 0));
        let mut mask = [0.0; PIXELS];
        for i in 0..PIXELS {
            let inside = (x[i] >= self.low[0])
                & (x[i] <= self.high[0])
                & (y[i] >= self.low[1])
                & (y[i] <= self.high[1]);
            mask[i] = f32::from(u8::from(inside));
        }
        mask
    }
}

/// The longer semi-axis of the ellipse that a linear map makes of the unit circle, and the length of
/// the shorter one.
fn axes(J: &Matrix2<f64>) -> (Vector2<f64>, f64) {
    let product = J * J.transpose();
    let mean = 0.5 * (product.m11 + product.m22);
    let half_difference = 0.5 * (product.m11 - product.m22);
    let radius = half_difference.hypot(product.m12);
    // Two multiples of the eigenvector; one of them vanishes where it lies along an axis.
    let (along_x, along_y) = (
        Vector2::new(radius + half_difference, product.m12),
        Vector2::new(product.m12, radius - half_difference),
    );
    let direction = if half_difference >= 0.0 {
        along_x
    } else {
        along_y
    };
    let long = (mean + radius).sqrt();
    let narrow = J.determinant().abs() / long.max(f64::MIN_POSITIVE);
    // A circle has no longer axis: any will do.
    let direction = direction.try_normalize(0.0).unwrap_or_else(Vector2::x);
    (direction * long, narrow)
}

/// The homography from bordered tile pixels to a level's pixels, scaled to one at the first pixel.
fn level_from_tile(view: &View, tile: Tile, [sx, sy]: [f64; 2]) -> [f32; 9] {
    let (x, y) = (tile.x as f64 - 1.0, tile.y as f64 - 1.0);
    let mut m = view.inverse;
    // Pixel centres are half a pixel from edge coordinates.
    let last = m.row(2).into_owned();
    let first_row = m.row(0) * sx - last * 0.5;
    let second_row = m.row(1) * sy - last * 0.5;
    m.set_row(0, &first_row);
    m.set_row(1, &second_row);
    let shifted = m.column(0) * x + m.column(1) * y + m.column(2);
    m.set_column(2, &shifted);
    m /= shifted.z;
    [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|i| m[(i / 3, i % 3)] as f32)
}

/// Adds the level between four pixels each, at positions moved alike; beyond its border the border
/// continues.
#[inline(always)]
fn add_samples(
    level: &Level,
    columns: &[f32; BORDERED_PIXELS],
    rows: &[f32; BORDERED_PIXELS],
    moved: [f32; 2],
    sums: &mut [f32; BORDERED_PIXELS],
) {
    let last = [level.width - 1, level.height - 1].map(|last| last as f32 - 1e-3);
    let width = level.width as i32;
    let (mut fx, mut fy) = ([0.0; BORDERED_PIXELS], [0.0; BORDERED_PIXELS]);
    let mut first = [0i32; BORDERED_PIXELS];
    for i in 0..BORDERED_PIXELS {
        // NaN becomes zero by `max`.
        let x = (columns[i] + moved[0]).max(0.0).min(last[0]);
        let y = (rows[i] + moved[1]).max(0.0).min(last[1]);
        let (column, row) = (x as i32, y as i32);
        fx[i] = x - column as f32;
        fy[i] = y - row as f32;
        first[i] = row * width + column;
    }
    let (mut above, mut below) = ([0u16; BORDERED_PIXELS], [0u16; BORDERED_PIXELS]);
    for i in 0..BORDERED_PIXELS {
        above[i] = pair(&level.pixels, first[i] as usize);
        below[i] = pair(&level.pixels, first[i] as usize + level.width);
    }
    for i in 0..BORDERED_PIXELS {
        let upper = blend(above[i], fx[i]);
        let lower = blend(below[i], fx[i]);
        sums[i] += upper + fy[i] * (lower - upper);
    }
}

const fn grid() -> [[f32; BORDERED_PIXELS]; 2] {
    let mut grid = [[0.0; BORDERED_PIXELS]; 2];
    let mut i = 0;
    while i < BORDERED_PIXELS {
        grid[0][i] = (i % BORDERED) as f32;
        grid[1][i] = (i / BORDERED) as f32;
        i += 1;
    }
    grid
}

/// The tile's own pixels of a bordered tile, moved by a number of pixels.
#[inline(always)]
pub fn inner(bordered: &[f32; BORDERED_PIXELS], moved: isize) -> [f32; PIXELS] {
    let mut values = [0.0; PIXELS];
    let start = (BORDERED + 1).wrapping_add_signed(moved);
    for (row, out) in values.chunks_exact_mut(SIDE).enumerate() {
        let first = start + row * BORDERED;
        out.copy_from_slice(&bordered[first..first + SIDE]);
    }
    values
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn the_longer_axis_is_that_of_the_singular_values() {
        let [cos, sin] = [0.8, 0.6];
        let rotation = Matrix2::new(cos, -sin, sin, cos);
        for (a, b) in [(3.0, 1.0), (1.0, 3.0), (2.0, 2.0)] {
            let J = rotation * Matrix2::new(a, 0.0, 0.0, b) * rotation.transpose();
            let (long, narrow) = axes(&J);
            assert!((long.norm() - a.max(b)).abs() < 1e-12);
            assert!((narrow - a.min(b)).abs() < 1e-12);
            let expected = rotation.column(usize::from(b > a)).into_owned();
            assert!(a == b || (long.normalize().dot(&expected).abs() - 1.0).abs() < 1e-12);
        }
        let (long, narrow) = axes(&Matrix2::zeros());
        assert_eq!((long.norm(), narrow), (0.0, 0.0));
    }
}
