//! A start that is many pixels off, but hardly turned or scaled: the best shift of all.

use nalgebra::{Matrix3, Vector2};

use super::descent::render;
use super::displacement::measure;
use super::tiles::{SIDE, choose};
use super::view::View;
use super::{AlignmentReference, AlignmentWorkspace};
use crate::GrayImage;

/// At most so many tiles are compared at each shift.
const MOST_TILES: usize = 48;
/// Fewer tiles fit anywhere.
const FEWEST_TILES: usize = 4;
/// A face with fewer tiles side by side, as small ones on a coarse frame, has overlapping ones …
const ENOUGH_TILES: usize = 16;
/// … at least so far apart \[px\].
const CLOSEST: usize = 2;

/// The start moved by the whole pixels, at most `radius` each way, with which its tiles correlate
/// best with the frame; `None` where it shows no front of the reference, or too little of its texture.
pub fn shifted(
    reference: &AlignmentReference,
    frame: &GrayImage<'_>,
    start: &Matrix3<f64>,
    radius: u32,
    workspace: &mut AlignmentWorkspace,
) -> Option<Matrix3<f64>> {
    let view = View::new(reference, start)?;
    let mut step = SIDE;
    loop {
        let tiles = &mut workspace.tiles;
        choose(&view, reference, frame, step, MOST_TILES, tiles);
        workspace.templates.clear();
        let chosen = workspace.tiles.len();
        render(&view, reference, 0..chosen, workspace);
        if workspace.templates.len() >= ENOUGH_TILES || step <= CLOSEST {
            break;
        }
        step /= 2;
    }
    if workspace.templates.len() < FEWEST_TILES {
        return None;
    }
    let radius = f64::from(radius);
    let mut best = (f64::NEG_INFINITY, Matrix3::identity());
    let steps = 2 * radius as usize + 1;
    for row in 0..steps {
        for column in 0..steps {
            let by = Vector2::new(column as f64, row as f64).add_scalar(-radius);
            let shift = Matrix3::new_translation(&by);
            // Tiles that would lie outside of the frame agree with nothing.
            let agreement: f64 = workspace
                .templates
                .iter()
                .filter_map(|template| measure(template, frame, &shift))
                .map(|displacement| displacement.correlation.max(0.0))
                .sum();
            if agreement > best.0 {
                best = (agreement, shift);
            }
        }
    }
    Some(best.1 * start)
}
