//! Alignment from a start that is many pixels off.

use nalgebra::Matrix3;

use super::align::{Alignment, align};
use super::area::Level;
use super::shift::shifted;
use super::{AlignmentConfig, AlignmentReference, AlignmentWorkspace};
use crate::GrayImage;

/// The frame at a half and at a quarter of its size, to begin on.
#[derive(Debug, Clone)]
pub struct CoarseFrames {
    /// The finest first.
    levels: Vec<Level>,
}

/// Number of coarse frames.
const LEVELS: usize = 2;
/// A pixel of a coarser frame is two wide: its place is known to one of them and some more.
const BETWEEN: u32 = 2;

impl CoarseFrames {
    /// Of an undistorted frame.
    pub fn new(frame: &GrayImage<'_>) -> Self {
        let mut level = Level {
            width: frame.width(),
            height: frame.height(),
            pixels: frame.pixels().to_vec(),
        };
        let levels = (0..LEVELS)
            .map(|_| {
                level = level.halved();
                level.clone()
            })
            .collect();
        Self { levels }
    }
}

/// [`align`] on ever finer frames: a tile measures displacements of few pixels only, which are many
/// pixels of the frame on a coarse one.
///
/// On each, the start is first moved by the best shift: on the coarsest of at most `radius` of its
/// pixels, then of so many as are between two of the coarser frame's. With a radius of 0 it is not
/// moved: a small face on a coarse frame is hardly worth a shift.
pub fn align_from_afar(
    reference: &AlignmentReference,
    frame: &GrayImage<'_>,
    coarse: &CoarseFrames,
    start: &Matrix3<f64>,
    radius: u32,
    config: &AlignmentConfig,
    workspace: &mut AlignmentWorkspace,
) -> Option<Alignment> {
    let between = radius.min(BETWEEN);
    let moved = |image: &GrayImage<'_>, H: &Matrix3<f64>, radius, workspace: &mut _| match radius {
        0 => None,
        radius => shifted(reference, image, H, radius, workspace),
    };
    let mut homography = *start;
    let mut radius = radius;
    for (number, level) in coarse.levels.iter().enumerate().rev() {
        let smaller = shrinking(2.0_f64.powi(number as i32 + 1));
        let Ok(image) = GrayImage::new(level.width, level.height, &level.pixels) else {
            continue;
        };
        let Some(larger) = smaller.try_inverse() else {
            continue;
        };
        let mut here = smaller * homography;
        here = moved(&image, &here, radius, workspace).unwrap_or(here);
        radius = between;
        here = align(reference, &image, &here, config, workspace)
            .map_or(here, |aligned| aligned.homography);
        homography = larger * here;
    }
    let start = moved(frame, &homography, between, workspace).unwrap_or(homography);
    align(reference, frame, &start, config, workspace)
}

/// From pixels of a frame to those of one that is smaller by a factor: edges coincide, not centres.
fn shrinking(factor: f64) -> Matrix3<f64> {
    let scale = 1.0 / factor;
    let shift = 0.5 * scale - 0.5;
    Matrix3::new(scale, 0.0, shift, 0.0, scale, shift, 0.0, 0.0, 1.0)
}
