//! Samples of an image on a turned and scaled grid.

use super::smoothed::Smoothed;

/// Where a square grid of samples lies in the image.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    /// Its centre [px].
    pub centre: [f32; 2],
    /// The step to the next sample of a row [px]; rows follow at a right angle, clockwise.
    pub step: [f32; 2],
    /// Number of samples along a side.
    pub side: usize,
}

/// Bilinear samples [1/256 grey levels]; those outside of the image are taken from its edge.
///
/// There are `side` rows; lanes from `side` on continue the grid.
#[inline(always)]
pub fn sample<const LANES: usize, const ROWS: usize>(
    image: &Smoothed,
    grid: &Grid,
) -> [[f32; LANES]; ROWS] {
    let mut samples = [[0.0; LANES]; ROWS];
    // The number of pairs that have another one below them.
    let n = image.pairs.len().saturating_sub(image.width);
    if n == 0 {
        return samples;
    }
    // All look-ups of a grid are made together: to read a vector right after its elements were
    // written one by one would stall.
    let places = places::<LANES, ROWS>(image, grid);
    let (above, below) = (&image.pairs[..n], &image.pairs[image.width..]);
    let mut pairs = [[[0_u32; LANES]; 2]; ROWS];
    for (pairs, index) in pairs.iter_mut().zip(&places.index) {
        let [upper, lower] = pairs;
        for ((upper, lower), &index) in upper.iter_mut().zip(lower).zip(index) {
            *upper = above.get(index as usize).map_or(0, |&pair| pair);
            *lower = below.get(index as usize).map_or(0, |&pair| pair);
        }
    }
    for i in 0..ROWS {
        for j in 0..LANES {
            let upper = interpolate(pairs[i][0][j], places.x[i][j]);
            let lower = interpolate(pairs[i][1][j], places.x[i][j]);
            samples[i][j] = upper + places.y[i][j] * (lower - upper);
        }
    }
    samples
}

/// Where the samples of a grid lie: the pair to the upper left, and the way on from there, 0…1.
struct Places<const LANES: usize, const ROWS: usize> {
    index: [[u32; LANES]; ROWS],
    x: [[f32; LANES]; ROWS],
    y: [[f32; LANES]; ROWS],
}

#[inline(always)]
fn places<const LANES: usize, const ROWS: usize>(
    image: &Smoothed,
    grid: &Grid,
) -> Places<LANES, ROWS> {
    let mut places = Places {
        index: [[0; LANES]; ROWS],
        x: [[0.0; LANES]; ROWS],
        y: [[0.0; LANES]; ROWS],
    };
    let middle = 0.5 * (grid.side - 1) as f32;
    let to_samples = |pixel: f32| (pixel - image.origin) / image.step;
    let (dx, dy) = (grid.step[0] / image.step, grid.step[1] / image.step);
    let x0 = to_samples(grid.centre[0]) - middle * (dx - dy);
    let y0 = to_samples(grid.centre[1]) - middle * (dx + dy);
    let (right, bottom) = ((image.width - 1) as f32, (image.height - 2) as f32);
    for i in 0..grid.side.min(ROWS) {
        let (x0, y0) = (x0 - i as f32 * dy, y0 + i as f32 * dx);
        for j in 0..LANES {
            let x = clamp(x0 + j as f32 * dx, right + 1.0);
            let y = clamp(y0 + j as f32 * dy, bottom + 1.0);
            let column = round(clamp(x - 0.5, right));
            let line = round(clamp(y - 0.5, bottom));
            places.x[i][j] = x - column.0;
            places.y[i][j] = y - line.0;
            places.index[i][j] = line.1 * image.width as u32 + column.1;
        }
    }
    places
}

/// Within 0 and `largest`; `f32::clamp` would care for NaN.
#[inline(always)]
fn clamp(value: f32, largest: f32) -> f32 {
    let value = if value > 0.0 { value } else { 0.0 };
    if value < largest { value } else { largest }
}

/// Between the two samples of a pair.
#[inline(always)]
fn interpolate(pair: u32, share: f32) -> f32 {
    let (left, right) = ((pair & 0xffff) as i32 as f32, (pair >> 16) as i32 as f32);
    left + share * (right - left)
}

/// The integer next to 0 ≤ value < 2²², as a float and as an integer.
///
/// Of a float as large as 2²³ the mantissa counts ones. A cast would do the same, but its checks
/// for what does not fit keep it from being vectorised.
#[inline(always)]
pub fn round(value: f32) -> (f32, u32) {
    const ONES: f32 = 8_388_608.0;
    let shifted = value + ONES;
    (shifted - ONES, shifted.to_bits() & 0x7f_ffff)
}
