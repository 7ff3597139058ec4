//! Extrema of the differences of Gaussians over place and scale (Lowe, section 3.1).

use pulp::Simd;

use super::ring::RowRing;
use super::simd::{load, store};

/// No extremum is looked for closer to the border [px] (as in OpenCV).
pub const BORDER: usize = 5;
/// Lanes of the widest vector.
const MAX_LANES: usize = 16;

/// Calls `found` with the column of each extremum of row y of difference `layer`, from left to
/// right: values beyond ±`threshold` that none of their 26 neighbours exceeds.
#[inline(always)]
pub fn scan_row<S: Simd>(
    simd: S,
    differences: &[RowRing],
    (layer, y, width): (usize, usize, usize),
    threshold: f32,
    mut found: impl FnMut(usize),
) {
    let rows: [[&[f32]; 3]; 3] =
        std::array::from_fn(|s| std::array::from_fn(|r| differences[layer + s - 1].row(y + r - 1)));
    let limit = simd.splat_f32s(threshold);
    let (mut x, end) = (BORDER, width.saturating_sub(BORDER));
    while x < end {
        let value = load::<S>(rows[1][1], x);
        let strong = simd.greater_than_f32s(simd.abs_f32s(value), limit);
        if simd.first_true_m32s(strong) < S::F32_LANES {
            let hits = simd.and_m32s(strong, planar_extremum(simd, rows, value, x));
            if simd.first_true_m32s(hits) < S::F32_LANES {
                let mut flags = [0.0; MAX_LANES];
                let (none, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
                store::<S>(&mut flags, 0, simd.select_f32s(hits, one, none));
                for (lane, &flag) in flags[..S::F32_LANES.min(end - x)].iter().enumerate() {
                    if flag != 0.0 && is_extremum(rows, x + lane) {
                        found(x + lane);
                    }
                }
            }
        }
        x += S::F32_LANES;
    }
}

/// Where no neighbour in the same difference, above and below in scale is more extreme.
#[inline(always)]
fn planar_extremum<S: Simd>(simd: S, rows: [[&[f32]; 3]; 3], value: S::f32s, x: usize) -> S::m32s {
    let [above, middle, below] = rows[1];
    let mut high = simd.max_f32s(load::<S>(middle, x - 1), load::<S>(middle, x + 1));
    let mut low = simd.min_f32s(load::<S>(middle, x - 1), load::<S>(middle, x + 1));
    let mut include = |neighbour| {
        high = simd.max_f32s(high, neighbour);
        low = simd.min_f32s(low, neighbour);
    };
    for row in [above, below] {
        for column in x - 1..=x + 1 {
            include(load::<S>(row, column));
        }
    }
    include(load::<S>(rows[0][1], x));
    include(load::<S>(rows[2][1], x));
    simd.or_m32s(
        simd.greater_than_or_equal_f32s(value, high),
        simd.less_than_or_equal_f32s(value, low),
    )
}

/// Whether no neighbour of column x of the middle row is more extreme.
#[inline(always)]
fn is_extremum(rows: [[&[f32]; 3]; 3], x: usize) -> bool {
    let value = rows[1][1][x];
    let mut neighbours = rows.iter().flatten().flat_map(|row| &row[x - 1..=x + 1]);
    if value > 0.0 {
        neighbours.all(|&v| v <= value)
    } else {
        neighbours.all(|&v| v >= value)
    }
}
