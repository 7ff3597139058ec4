//! How far a rendered tile is displaced in the frame.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::template::{Template, dot};
use super::tiles::{PIXELS, SIDE};
use super::view::{apply, jacobian};
use crate::GrayImage;

/// Gains beyond this, either way, are no change of the lighting.
const LARGEST_GAIN: f64 = 8.0;
/// Variance of a grey value at least: that of rounding and of the little noise every camera has.
const LEAST_VARIANCE: f64 = 1.0;

/// One tile's evidence about the motion of the frame.
#[derive(Debug, Clone, Copy)]
pub struct Displacement {
    /// Where the tile's centre is predicted in the frame \[px\].
    pub predicted: Vector2<f64>,
    /// How far from there the frame shows it \[px\].
    pub offset: Vector2<f64>,
    /// Covariance of the offset \[px²\].
    pub covariance: Matrix2<f64>,
    /// Correlation of the frame at the prediction with the tile, -1 … 1.
    pub correlation: f64,
}

/// Sums over a tile's pixels of the frame.
struct Sums {
    value: f32,
    squared: f32,
    by_template: f32,
    by_gradient: [f32; 2],
}

/// Measures one tile where `motion`, a homography of the frame near the identity, predicts it.
///
/// `None` where that is outside of the frame or the frame is uniform there.
#[inline(always)]
pub fn measure(
    template: &Template,
    frame: &GrayImage,
    motion: &Matrix3<f64>,
) -> Option<Displacement> {
    let centre = template.tile.centre();
    let predicted = apply(motion, centre);
    let sums = sums(template, frame, predicted - centre)?;
    let (count, energy) = (f64::from(template.count), f64::from(template.energy));
    let value = f64::from(sums.value);
    let variation = f64::from(sums.squared) - value * value / count;
    let by_template = f64::from(sums.by_template);
    if variation <= 0.0 {
        return None;
    }
    let gain = by_template / energy;
    let correlation = by_template / (energy * variation).sqrt();
    if !(1.0 / LARGEST_GAIN..=LARGEST_GAIN).contains(&gain) {
        return Some(Displacement {
            predicted,
            offset: Vector2::zeros(),
            covariance: Matrix2::identity(),
            correlation: correlation.min(0.0),
        });
    }
    let by_gradient = Vector2::from(sums.by_gradient.map(f64::from));
    let linear = jacobian(motion, centre) - Matrix2::identity();
    let by_linear = (template.linear[0] * linear[(0, 0)] + template.linear[1] * linear[(0, 1)])
        + (template.linear[2] * linear[(1, 0)] + template.linear[3] * linear[(1, 1)]);
    let offset = -(template.inverse_products * (by_gradient / gain + by_linear));
    let explained =
        gain * by_template + by_gradient.dot(&(template.inverse_products * by_gradient));
    let variance = ((variation - explained) / (count - 4.0)).max(LEAST_VARIANCE);
    Some(Displacement {
        predicted,
        offset,
        covariance: template.inverse_products * (variance / (gain * gain)),
        correlation,
    })
}

/// Reads the frame at the tile's pixels, all displaced alike.
#[inline(always)]
fn sums(template: &Template, frame: &GrayImage, displacement: Vector2<f64>) -> Option<Sums> {
    let (x, fx) = place(template.tile.x, displacement.x, frame.width())?;
    let (y, fy) = place(template.tile.y, displacement.y, frame.height())?;
    let values = displaced(frame, [x, y], [fx, fy]);
    let mut inside = [0.0; PIXELS];
    for i in 0..PIXELS {
        inside[i] = values[i] * template.mask[i];
    }
    Some(Sums {
        value: dot(&values, &template.mask),
        squared: dot(&values, &inside),
        by_template: dot(&values, &template.values),
        by_gradient: [
            dot(&values, &template.gradients[0]),
            dot(&values, &template.gradients[1]),
        ],
    })
}

/// The frame between pixels, about mid grey so that squares stay small.
#[inline(always)]
fn displaced(frame: &GrayImage, [x, y]: [usize; 2], [fx, fy]: [f32; 2]) -> [f32; PIXELS] {
    let mut values = [0.0; PIXELS];
    let mut above = horizontal(frame, x, y, fx);
    for (row, values) in values.as_chunks_mut::<SIDE>().0.iter_mut().enumerate() {
        let below = horizontal(frame, x, y + row + 1, fx);
        for i in 0..SIDE {
            values[i] = above[i] + fy * (below[i] - above[i]);
        }
        above = below;
    }
    values
}

/// First pixel and fraction of a displaced tile; `None` unless all of it is in the frame.
#[inline(always)]
fn place(first: usize, displacement: f64, length: usize) -> Option<(usize, f32)> {
    let position = first as f64 + displacement;
    let whole = position.floor();
    let fits = whole >= 0.0 && whole + SIDE as f64 + 1.0 <= length as f64;
    fits.then_some((whole as usize, (position - whole) as f32))
}

/// One row of the frame between columns, less mid grey.
#[inline(always)]
fn horizontal(frame: &GrayImage, x: usize, y: usize, fraction: f32) -> [f32; SIDE] {
    let row = &frame.row(y)[x..x + SIDE + 1];
    let mut values = [0.0; SIDE];
    for i in 0..SIDE {
        let (left, right) = (f32::from(row[i]), f32::from(row[i + 1]));
        values[i] = left + fraction * (right - left) - 128.0;
    }
    values
}
