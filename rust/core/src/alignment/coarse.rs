//! Alignment from a start that is many pixels off.

use nalgebra::Matrix3;

use super::align::{Alignment, align};
use super::area::Level;
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
pub fn align_from_afar(
    reference: &AlignmentReference,
    frame: &GrayImage<'_>,
    coarse: &CoarseFrames,
    start: &Matrix3<f64>,
    config: &AlignmentConfig,
    workspace: &mut AlignmentWorkspace,
) -> Option<Alignment> {
    let mut homography = *start;
    for (number, level) in coarse.levels.iter().enumerate().rev() {
        let Ok(image) = GrayImage::new(level.width, level.height, &level.pixels) else {
            continue;
        };
        let smaller = shrinking(2.0_f64.powi(number as i32 + 1));
        let aligned = align(
            reference,
            &image,
            &(smaller * homography),
            config,
            workspace,
        );
        if let (Some(aligned), Some(larger)) = (aligned, smaller.try_inverse()) {
            homography = larger * aligned.homography;
        }
    }
    align(reference, frame, &homography, config, workspace)
}

/// From pixels of a frame to those of one that is smaller by a factor: edges coincide, not centres.
fn shrinking(factor: f64) -> Matrix3<f64> {
    let scale = 1.0 / factor;
    let shift = 0.5 * scale - 0.5;
    Matrix3::new(scale, 0.0, shift, 0.0, scale, shift, 0.0, 0.0, 1.0)
}
