//! Maxima of the determinant over position and scale (Bay et al., section 3.4).

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::descriptor::DIAMETER;
use super::hessian::{BAND, Octave};
use crate::Keypoint;

/// Standard deviation over side of a filter: the one of 9 × 9 stands for 1.2 px.
const SIGMA_OVER_SIZE: f32 = 1.2 / 9.0;
/// A maximum may lie this far from its grid point, in grid steps, before it counts as another's.
const REACH: f32 = 1.0;

/// What one band of rows gave.
#[derive(Debug, Clone, Default)]
pub struct BandOfKeypoints {
    peaks: Vec<u8>,
    keypoints: Vec<Keypoint>,
}

/// Appends the maxima of an octave above the threshold, without an orientation yet, in the order of rows within layers
/// within bands.
pub fn find(
    octave: &Octave,
    size: (usize, usize),
    threshold: f32,
    bands: &mut Vec<BandOfKeypoints>,
    keypoints: &mut Vec<Keypoint>,
) {
    let count = octave.rows.div_ceil(BAND);
    bands.resize_with(count.max(bands.len()), BandOfKeypoints::default);
    let bands = &mut bands[..count];
    bands.par_iter_mut().enumerate().for_each(|(i, band)| {
        Arch::new().dispatch(BandSearch {
            octave,
            rows: i * BAND..((i + 1) * BAND).min(octave.rows),
            size,
            threshold,
            band,
        });
    });
    for band in bands {
        keypoints.extend_from_slice(&band.keypoints);
    }
}

/// The search in a band of rows, within an image of width × height.
struct BandSearch<'a> {
    octave: &'a Octave,
    rows: Range<usize>,
    size: (usize, usize),
    threshold: f32,
    band: &'a mut BandOfKeypoints,
}

impl WithSimd for BandSearch<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.band.peaks.resize(self.octave.columns, 0);
        self.band.keypoints.clear();
        for layer in 1..self.octave.layers.len() - 1 {
            // All 26 neighbours must be valid, those in the layer of the largest filter too.
            let columns = inner(self.octave.valid(layer + 1, self.size.0));
            let valid = inner(self.octave.valid(layer + 1, self.size.1));
            if columns.is_empty() {
                continue;
            }
            for row in self.rows.start.max(valid.start)..self.rows.end.min(valid.end) {
                let peaks = &mut self.band.peaks[..columns.len()];
                let start = Place {
                    layer,
                    row,
                    column: columns.start,
                };
                mark_peaks(self.octave, start, self.threshold, peaks);
                collect(self.octave, start, peaks, &mut self.band.keypoints);
            }
        }
    }
}

/// A range without its first and last element.
fn inner(range: Range<usize>) -> Range<usize> {
    range.start + 1..range.end.max(1) - 1
}

/// Appends the maxima among the marked places of a row.
#[inline(always)]
fn collect(octave: &Octave, start: Place, peaks: &[u8], keypoints: &mut Vec<Keypoint>) {
    for (i, chunk) in peaks.chunks(32).enumerate() {
        if chunk.iter().fold(0, |any, &peak| any | peak) == 0 {
            continue;
        }
        for (j, _) in chunk.iter().enumerate().filter(|&(_, &peak)| peak != 0) {
            let at = Place {
                column: start.column + 32 * i + j,
                ..start
            };
            if is_maximum(octave, at) {
                keypoints.extend(interpolate(octave, at));
            }
        }
    }
}

/// Marks with 1 what is above the threshold and no less than its neighbours in the same column
/// and row: few remain for the whole comparison.
#[inline(always)]
fn mark_peaks(octave: &Octave, start: Place, threshold: f32, peaks: &mut [u8]) {
    let (n, Place { layer, row, column }) = (peaks.len(), start);
    let at =
        |row: usize, column: usize| &octave.layers[layer][row * octave.columns + column..][..n];
    let centre = at(row, column);
    let (left, right) = (at(row, column - 1), at(row, column + 1));
    let (above, below) = (at(row - 1, column), at(row + 1, column));
    for (i, peak) in peaks.iter_mut().enumerate() {
        let across = larger(left[i], right[i]);
        let largest = larger(across, larger(above[i], below[i]));
        *peak = u8::from((centre[i] > threshold) & (centre[i] >= largest));
    }
}

/// The larger of two numbers: `f32::max` would look for NaN.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[derive(Debug, Clone, Copy)]
struct Place {
    layer: usize,
    row: usize,
    column: usize,
}

impl Place {
    /// The determinant at a neighbour, -1 ≤ each offset ≤ 1.
    fn neighbour(self, octave: &Octave, layer: isize, row: isize, column: isize) -> f32 {
        let row = self.row.wrapping_add_signed(row);
        let column = self.column.wrapping_add_signed(column);
        octave.layers[self.layer.wrapping_add_signed(layer)][row * octave.columns + column]
    }
}

/// Whether no neighbour is larger. Of equal ones, as symmetric images have them, the first in the
/// order of layers, rows and columns is the maximum.
fn is_maximum(octave: &Octave, at: Place) -> bool {
    let centre = at.neighbour(octave, 0, 0, 0);
    for layer in -1..=1 {
        for row in -1..=1 {
            for column in -1..=1 {
                let other = at.neighbour(octave, layer, row, column);
                let before = (layer, row, column) < (0, 0, 0);
                if other > centre || (before && other == centre) {
                    return false;
                }
            }
        }
    }
    true
}

/// The maximum of the quadratic through the neighbours (Brown & Lowe, BMVC 2002), unless it lies
/// out of reach.
fn interpolate(octave: &Octave, at: Place) -> Option<Keypoint> {
    let d = |layer, row, column| at.neighbour(octave, layer, row, column);
    let centre = d(0, 0, 0);
    let gradient = 0.5
        * Vector3::new(
            d(0, 0, 1) - d(0, 0, -1),
            d(0, 1, 0) - d(0, -1, 0),
            d(1, 0, 0) - d(-1, 0, 0),
        );
    let xx = d(0, 0, 1) + d(0, 0, -1) - 2.0 * centre;
    let yy = d(0, 1, 0) + d(0, -1, 0) - 2.0 * centre;
    let ss = d(1, 0, 0) + d(-1, 0, 0) - 2.0 * centre;
    let xy = 0.25 * (d(0, 1, 1) + d(0, -1, -1) - d(0, 1, -1) - d(0, -1, 1));
    let xs = 0.25 * (d(1, 0, 1) + d(-1, 0, -1) - d(1, 0, -1) - d(-1, 0, 1));
    let ys = 0.25 * (d(1, 1, 0) + d(-1, -1, 0) - d(1, -1, 0) - d(-1, 1, 0));
    let curvature = Matrix3::new(xx, xy, xs, xy, yy, ys, xs, ys, ss);
    let offset = -(curvature.try_inverse()? * gradient);
    if !offset.iter().all(|o| o.abs() <= REACH) {
        return None;
    }
    let step = octave.step as f32;
    let increment = (octave.sizes[1] - octave.sizes[0]) as f32;
    let size = octave.sizes[at.layer] as f32 + offset.z * increment;
    Some(Keypoint {
        x: (at.column as f32 + offset.x) * step,
        y: (at.row as f32 + offset.y) * step,
        scale: DIAMETER * size * SIGMA_OVER_SIZE,
        angle: 0.0,
        response: centre + 0.5 * gradient.dot(&offset),
        sign: 0,
    })
}
