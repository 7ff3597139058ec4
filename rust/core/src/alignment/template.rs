//! The reference as the frame should show it, tile by tile.
//!
//! A frame's pixel sees the mean over its footprint on the face. Where the face is oblique, that is
//! long and narrow: the pyramid level is that of its narrow side, and several samples are spread
//! along its long side (as in anisotropic texture filtering, McCormack et al., SIGGRAPH 1999).

use nalgebra::{Matrix2, Vector2};

use super::AlignmentReference;
use super::area::Level;
use super::tiles::{PIXELS, SIDE, Tile};
use super::view::View;

/// Side of a tile with the border that its gradients need.
const BORDERED: usize = SIDE + 2;
const BORDERED_PIXELS: usize = BORDERED * BORDERED;
/// Samples along a footprint, at most.
const MOST_SAMPLES: f64 = 8.0;
/// A pixel counts if the reference covers it and its neighbours: half of three pixels.
const REACH: f64 = 1.5;
/// Fewer pixels than this determine no displacement, gain and bias.
const FEWEST_PIXELS: f32 = 24.0;
/// Tiles with a smaller standard deviation \[grey levels\] show noise rather than texture.
const LEAST_CONTRAST: f32 = 2.0;

/// A rendered tile. Pixels outside of the reference have zeros everywhere.
#[derive(Debug, Clone)]
pub struct Template {
    /// Which pixels of the frame.
    pub tile: Tile,
    /// Its number among the chosen tiles.
    pub number: usize,
    /// One where the reference is, zero elsewhere.
    pub mask: [f32; PIXELS],
    /// Grey values, less their mean.
    pub values: [f32; PIXELS],
    /// Gradients along x and y, less what gain and bias can explain.
    pub gradients: [[f32; PIXELS]; 2],
    /// Number of pixels of the reference.
    pub count: f32,
    /// Sum of squared values.
    pub energy: f32,
    /// Inverse of the gradients' sum of products, 2×2.
    pub inverse_products: Matrix2<f64>,
    /// What a linear motion of the tile's pixels about its centre adds to the sums of gradient times
    /// frame: by the entries (xx, xy, yx, yy) of the motion, 2 sums each.
    pub linear: [Vector2<f64>; 4],
}

/// A tile's map into one level of the reference.
struct Footprint<'a> {
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

impl Template {
    /// Renders a tile; `None` where it has too little texture to be worth a comparison.
    #[inline(always)]
    pub fn render(
        number: usize,
        tile: Tile,
        view: &View,
        reference: &AlignmentReference,
    ) -> Option<Self> {
        let footprint = Footprint::new(tile, view, reference);
        let (columns, rows) = footprint.positions();
        let bordered = footprint.sample(&columns, &rows);
        let mask = footprint.mask(&columns, &rows);
        Self::new(number, tile, mask, &bordered)
    }

    #[inline(always)]
    fn new(
        number: usize,
        tile: Tile,
        mask: [f32; PIXELS],
        bordered: &[f32; BORDERED_PIXELS],
    ) -> Option<Self> {
        let count: f32 = mask.iter().sum();
        if count < FEWEST_PIXELS {
            return None;
        }
        let mut values = inner(bordered, 0);
        let mean = dot(&values, &mask) / count;
        for (value, inside) in values.iter_mut().zip(&mask) {
            *value = (*value - mean) * inside;
        }
        let energy = dot(&values, &values);
        if energy < LEAST_CONTRAST * LEAST_CONTRAST * count {
            return None;
        }
        let raw = [1, BORDERED].map(|step| {
            let (after, before) = (
                inner(bordered, step as isize),
                inner(bordered, -(step as isize)),
            );
            let mut gradient = [0.0; PIXELS];
            for i in 0..PIXELS {
                gradient[i] = 0.5 * (after[i] - before[i]) * mask[i];
            }
            gradient
        });
        let gradients = raw.map(|gradient| {
            let bias = dot(&gradient, &mask) / count;
            let gain = dot(&gradient, &values) / energy;
            let mut rest = [0.0; PIXELS];
            for i in 0..PIXELS {
                rest[i] = gradient[i] - bias * mask[i] - gain * values[i];
            }
            rest
        });
        let product = |a: usize, b: usize| f64::from(dot(&gradients[a], &gradients[b]));
        let products = Matrix2::new(product(0, 0), product(0, 1), product(1, 0), product(1, 1));
        // One direction without texture says nothing there: its information is nearly zero.
        let regularised = products + Matrix2::identity() * (1e-3 * products.trace() + 1e-3);
        Some(Self {
            tile,
            number,
            mask,
            values,
            count,
            energy,
            inverse_products: regularised.try_inverse()?,
            linear: linear_terms(&raw, &gradients),
            gradients,
        })
    }
}

impl<'a> Footprint<'a> {
    fn new(tile: Tile, view: &View, reference: &'a AlignmentReference) -> Self {
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
    fn positions(&self) -> ([f32; BORDERED_PIXELS], [f32; BORDERED_PIXELS]) {
        let (mut columns, mut rows) = ([0.0; BORDERED_PIXELS], [0.0; BORDERED_PIXELS]);
        let m = &self.map;
        for v in 0..BORDERED {
            let y = v as f32;
            for u in 0..BORDERED {
                let x = u as f32;
                let w = 1.0 / (m[6] * x + m[7] * y + m[8]);
                columns[v * BORDERED + u] = (m[0] * x + m[1] * y + m[2]) * w;
                rows[v * BORDERED + u] = (m[3] * x + m[4] * y + m[5]) * w;
            }
        }
        (columns, rows)
    }

    /// Means over the footprints.
    #[inline(always)]
    fn sample(
        &self,
        columns: &[f32; BORDERED_PIXELS],
        rows: &[f32; BORDERED_PIXELS],
    ) -> [f32; BORDERED_PIXELS] {
        let mut sums = [0.0; BORDERED_PIXELS];
        for sample in 0..self.samples {
            let offset = sample as f32 - 0.5 * (self.samples as f32 - 1.0);
            let (dx, dy) = (offset * self.step[0], offset * self.step[1]);
            for i in 0..BORDERED_PIXELS {
                sums[i] += bilinear(self.level, columns[i] + dx, rows[i] + dy);
            }
        }
        let share = 1.0 / self.samples as f32;
        sums.map(|sum| sum * share)
    }

    /// One for the tile's pixels whose footprint and neighbours lie within the reference.
    #[inline(always)]
    fn mask(
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
    let angle = 0.5 * product.m12.atan2(half_difference);
    let long = (mean + radius).sqrt();
    let narrow = J.determinant().abs() / long.max(f64::MIN_POSITIVE);
    (Vector2::new(angle.cos(), angle.sin()) * long, narrow)
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

/// The level between four pixels; beyond its border the border continues.
#[inline(always)]
fn bilinear(level: &Level, x: f32, y: f32) -> f32 {
    // NaN becomes zero by `max`.
    let x = x.max(0.0).min((level.width - 1) as f32 - 1e-3);
    let y = y.max(0.0).min((level.height - 1) as f32 - 1e-3);
    let (column, row) = (x as usize, y as usize);
    let (fx, fy) = (x - column as f32, y - row as f32);
    let first = row * level.width + column;
    let above = &level.pixels[first..first + 2];
    let below = &level.pixels[first + level.width..first + level.width + 2];
    let blend = |pair: &[u8]| {
        let (a, b) = (f32::from(pair[0]), f32::from(pair[1]));
        a + fx * (b - a)
    };
    let (upper, lower) = (blend(above), blend(below));
    upper + fy * (lower - upper)
}

/// The tile's own pixels of a bordered tile, moved by a number of pixels.
#[inline(always)]
fn inner(bordered: &[f32; BORDERED_PIXELS], moved: isize) -> [f32; PIXELS] {
    let mut values = [0.0; PIXELS];
    let start = (BORDERED + 1).wrapping_add_signed(moved);
    for (row, out) in values.chunks_exact_mut(SIDE).enumerate() {
        let first = start + row * BORDERED;
        out.copy_from_slice(&bordered[first..first + SIDE]);
    }
    values
}

/// Sum of products.
#[inline(always)]
fn dot(a: &[f32; PIXELS], b: &[f32; PIXELS]) -> f32 {
    let mut sums = [0.0; SIDE];
    for (a, b) in a.chunks_exact(SIDE).zip(b.chunks_exact(SIDE)) {
        for i in 0..SIDE {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum()
}

/// Σ rest · (raw gradient · motion · offset from the centre), by the entries of the motion.
#[inline(always)]
fn linear_terms(raw: &[[f32; PIXELS]; 2], rest: &[[f32; PIXELS]; 2]) -> [Vector2<f64>; 4] {
    let half = (SIDE as f32 - 1.0) / 2.0;
    [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(along, by)| {
        let mut moved = raw[along];
        for (i, value) in moved.iter_mut().enumerate() {
            let offset = if by == 0 { i % SIDE } else { i / SIDE };
            *value *= offset as f32 - half;
        }
        Vector2::new(
            f64::from(dot(&rest[0], &moved)),
            f64::from(dot(&rest[1], &moved)),
        )
    })
}
