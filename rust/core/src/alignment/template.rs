//! The reference as the frame should show it, tile by tile, prepared for measuring displacements.

use nalgebra::{Matrix2, Vector2};

use super::AlignmentReference;
use super::footprint::{BORDERED, BORDERED_PIXELS, Footprint, inner};
use super::tiles::{PIXELS, SIDE, Tile};
use super::view::View;

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
        let raw = [
            difference(bordered, 1, &mask),
            difference(bordered, BORDERED as isize, &mask),
        ];
        let gradients = [
            unexplained(&raw[0], &mask, &values, [count, energy]),
            unexplained(&raw[1], &mask, &values, [count, energy]),
        ];
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

/// Half the difference of the pixels after and before, where the mask is one.
#[inline(always)]
fn difference(
    bordered: &[f32; BORDERED_PIXELS],
    step: isize,
    mask: &[f32; PIXELS],
) -> [f32; PIXELS] {
    let (after, before) = (inner(bordered, step), inner(bordered, -step));
    let mut gradient = [0.0; PIXELS];
    for i in 0..PIXELS {
        gradient[i] = 0.5 * (after[i] - before[i]) * mask[i];
    }
    gradient
}

/// A gradient less its projections on the mask (a bias) and on the values (a gain), which are
/// orthogonal and have these squared norms.
#[inline(always)]
fn unexplained(
    gradient: &[f32; PIXELS],
    mask: &[f32; PIXELS],
    values: &[f32; PIXELS],
    [count, energy]: [f32; 2],
) -> [f32; PIXELS] {
    let bias = dot(gradient, mask) / count;
    let gain = dot(gradient, values) / energy;
    let mut rest = [0.0; PIXELS];
    for i in 0..PIXELS {
        rest[i] = gradient[i] - bias * mask[i] - gain * values[i];
    }
    rest
}

/// Sum of products.
#[inline(always)]
pub fn dot(a: &[f32; PIXELS], b: &[f32; PIXELS]) -> f32 {
    let mut sums = [0.0; SIDE];
    for (a, b) in a.as_chunks::<SIDE>().0.iter().zip(b.as_chunks::<SIDE>().0) {
        for i in 0..SIDE {
            sums[i] += a[i] * b[i];
        }
    }
    let halves = [0, 1, 2, 3].map(|i| sums[i] + sums[i + 4]);
    (halves[0] + halves[2]) + (halves[1] + halves[3])
}

/// Σ rest · (raw gradient · motion · offset from the centre), by the entries of the motion.
#[inline(always)]
fn linear_terms(raw: &[[f32; PIXELS]; 2], rest: &[[f32; PIXELS]; 2]) -> [Vector2<f64>; 4] {
    let half = (SIDE as f32 - 1.0) / 2.0;
    let mut terms = [Vector2::zeros(); 4];
    for (along, gradient) in raw.iter().enumerate() {
        let (mut across, mut down) = ([0.0; PIXELS], [0.0; PIXELS]);
        for i in 0..PIXELS {
            across[i] = gradient[i] * ((i % SIDE) as f32 - half);
            down[i] = gradient[i] * ((i / SIDE) as f32 - half);
        }
        for (by, moved) in [across, down].iter().enumerate() {
            let sums = [dot(&rest[0], moved), dot(&rest[1], moved)];
            terms[2 * along + by] = Vector2::new(f64::from(sums[0]), f64::from(sums[1]));
        }
    }
    terms
}
