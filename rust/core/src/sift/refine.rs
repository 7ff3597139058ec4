//! Where between the samples an extremum lies (Brown & Lowe, BMVC 2002; Lowe, section 4).

use nalgebra::{Matrix3, Vector3};

use super::extrema::BORDER;
use super::ring::RowRing;

/// A fit this close [samples] is not moved to another sample: somewhat more than half, or what
/// lies half-way between two would go to and fro.
const NEAR: f32 = 0.52;
/// How often the quadratic fit may move to another sample.
const MAX_MOVES: usize = 5;
/// How many rows it may move up or down in all.
pub const MAX_ROWS: usize = 4;

/// An extremum of the differences of Gaussians, in pixels of its octave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremum {
    /// Sample next to it: difference, row, column.
    pub sample: [u32; 3],
    /// Column.
    pub x: f32,
    /// Row.
    pub y: f32,
    /// Scale as a (fractional) number of layers from the octave's first level.
    pub layer: f32,
    /// Absolute value there [grey levels].
    pub response: f32,
    /// Whether it is a maximum, which a dark blob is: blur makes it brighter.
    pub is_maximum: bool,
}

/// What an extremum must fulfil.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Width of the octave [px].
    pub width: usize,
    /// Height of the octave [px].
    pub height: usize,
    /// Differences that have one above and one below are 1…layers.
    pub layers: usize,
    /// Smallest absolute value [grey levels].
    pub contrast: f32,
    /// Largest ratio of principal curvatures.
    pub edge: f32,
}

/// The extremum near a sample (difference, row, column); None where there is none, or one that is
/// too weak or on an edge.
#[inline(never)]
pub fn refine(differences: &[RowRing], start: [usize; 3], limits: &Limits) -> Option<Extremum> {
    let mut at = start;
    for _ in 0..MAX_MOVES {
        let fit = Fit::new(differences, at);
        let offset = fit.offset()?;
        if offset.iter().all(|o| o.abs() < NEAR) {
            return accept(&fit, &offset, at, limits);
        }
        at = moved(at, &offset, start[1], limits)?;
    }
    None
}

/// The sample nearest to the fitted extremum, if there is one with all its neighbours.
fn moved(
    [layer, y, x]: [usize; 3],
    offset: &Vector3<f32>,
    start_row: usize,
    limits: &Limits,
) -> Option<[usize; 3]> {
    // `as` saturates, so that a nearly singular fit moves out of the image.
    let to = |at: usize, o: f32| at.checked_add_signed(o.round() as isize);
    let (x, y, layer) = (to(x, offset.x)?, to(y, offset.y)?, to(layer, offset.z)?);
    let inside = (1..=limits.layers).contains(&layer)
        && (BORDER..limits.height - BORDER).contains(&y)
        && (BORDER..limits.width - BORDER).contains(&x)
        && y.abs_diff(start_row) <= MAX_ROWS;
    inside.then_some([layer, y, x])
}

fn accept(fit: &Fit, offset: &Vector3<f32>, at: [usize; 3], limits: &Limits) -> Option<Extremum> {
    let value = fit.value + 0.5 * fit.gradient.dot(offset);
    let response = value.abs();
    if response < limits.contrast || fit.is_edge(limits.edge) {
        return None;
    }
    Some(Extremum {
        sample: at.map(|i| i as u32),
        x: at[2] as f32 + offset.x,
        y: at[1] as f32 + offset.y,
        layer: at[0] as f32 + offset.z,
        response,
        is_maximum: value > 0.0,
    })
}

/// Value and derivatives at a sample, along x, y and scale.
struct Fit {
    value: f32,
    gradient: Vector3<f32>,
    hessian: Matrix3<f32>,
}

impl Fit {
    fn new(differences: &[RowRing], [layer, y, x]: [usize; 3]) -> Self {
        let rows: [[[f32; 3]; 3]; 3] = std::array::from_fn(|s| {
            std::array::from_fn(|r| {
                let row = differences[layer + s - 1].row(y + r - 1);
                [row[x - 1], row[x], row[x + 1]]
            })
        });
        // Indices count from -1 along scale, y and x.
        let v = |s: isize, r: isize, c: isize| {
            rows[(s + 1) as usize][(r + 1) as usize][(c + 1) as usize]
        };
        let center = v(0, 0, 0);
        let xx = v(0, 0, 1) + v(0, 0, -1) - 2.0 * center;
        let yy = v(0, 1, 0) + v(0, -1, 0) - 2.0 * center;
        let ss = v(1, 0, 0) + v(-1, 0, 0) - 2.0 * center;
        let xy = 0.25 * (v(0, 1, 1) - v(0, 1, -1) - v(0, -1, 1) + v(0, -1, -1));
        let xs = 0.25 * (v(1, 0, 1) - v(1, 0, -1) - v(-1, 0, 1) + v(-1, 0, -1));
        let ys = 0.25 * (v(1, 1, 0) - v(1, -1, 0) - v(-1, 1, 0) + v(-1, -1, 0));
        let gradient = 0.5
            * Vector3::new(
                v(0, 0, 1) - v(0, 0, -1),
                v(0, 1, 0) - v(0, -1, 0),
                v(1, 0, 0) - v(-1, 0, 0),
            );
        Self {
            value: center,
            gradient,
            hessian: Matrix3::new(xx, xy, xs, xy, yy, ys, xs, ys, ss),
        }
    }

    /// From the sample to the extremum of the quadratic; None where there is none.
    fn offset(&self) -> Option<Vector3<f32>> {
        let h = &self.hessian;
        let cofactors = Matrix3::new(
            h.m22 * h.m33 - h.m23 * h.m23,
            h.m13 * h.m23 - h.m12 * h.m33,
            h.m12 * h.m23 - h.m13 * h.m22,
            h.m13 * h.m23 - h.m12 * h.m33,
            h.m11 * h.m33 - h.m13 * h.m13,
            h.m12 * h.m13 - h.m11 * h.m23,
            h.m12 * h.m23 - h.m13 * h.m22,
            h.m12 * h.m13 - h.m11 * h.m23,
            h.m11 * h.m22 - h.m12 * h.m12,
        );
        let determinant = h.m11 * cofactors.m11 + h.m12 * cofactors.m12 + h.m13 * cofactors.m13;
        let offset = cofactors * self.gradient / -determinant;
        offset.iter().all(|o| o.is_finite()).then_some(offset)
    }

    /// Whether the principal curvatures in the image differ too much (Lowe, section 4.1).
    fn is_edge(&self, largest_ratio: f32) -> bool {
        let h = &self.hessian;
        let trace = h.m11 + h.m22;
        let determinant = h.m11 * h.m22 - h.m12 * h.m12;
        let bound = (largest_ratio + 1.0).powi(2) * determinant;
        determinant <= 0.0 || trace * trace * largest_ratio >= bound
    }
}
