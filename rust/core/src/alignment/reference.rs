//! What the alignment keeps of a face.

use super::area::Level;
use crate::{GrayImage, InputError};

/// Longer references are shrunk to this \[px\]: a face that a camera sees larger than this is
/// aligned better than any pose needs.
const LONGEST_SIDE: usize = 320;
/// Levels smaller than this carry no texture to align.
const SHORTEST_SIDE: usize = 8;
/// Cells along each side of the map of texture.
pub const CELLS: usize = 24;

/// A reference image prepared for alignment: a pyramid of at most 1.4 bytes a pixel of a
/// 320 px image, and a coarse map of its texture.
#[derive(Debug, Clone, PartialEq)]
pub struct AlignmentReference {
    width: f64,
    height: f64,
    levels: Vec<Level>,
    texture: Vec<f32>,
}

impl AlignmentReference {
    /// Prepares the reference image of a face.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] where a side is shorter than 8 px.
    pub fn new(image: GrayImage) -> Result<Self, InputError> {
        let (width, height) = (image.width(), image.height());
        let shortest = width.min(height);
        if shortest < SHORTEST_SIDE {
            return Err(InputError::OutOfRange {
                name: "the shortest side of a reference",
                value: shortest as f64,
                valid: "≥ 8 px",
            });
        }
        let mut first = Level {
            width,
            height,
            pixels: image.pixels().to_vec(),
        };
        let longest = width.max(height);
        if longest > LONGEST_SIDE {
            let side = |length: usize| {
                (length * LONGEST_SIDE)
                    .div_ceil(longest)
                    .max(SHORTEST_SIDE.min(length))
            };
            first = first.shrunk(side(width), side(height));
        }
        let texture = texture(&first);
        let mut levels = vec![first];
        while let Some(last) = levels.last() {
            if last.width.min(last.height) < 2 * SHORTEST_SIDE {
                break;
            }
            levels.push(last.halved());
        }
        Ok(Self {
            width: width as f64,
            height: height as f64,
            levels,
            texture,
        })
    }

    /// Width of the reference image as it was given \[px\].
    pub fn width(&self) -> f64 {
        self.width
    }

    /// Height of the reference image as it was given \[px\].
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Bytes that it occupies.
    pub fn bytes(&self) -> usize {
        let pixels: usize = self.levels.iter().map(|level| level.pixels.len()).sum();
        pixels + size_of_val(self.texture.as_slice())
    }

    /// The pyramid: each level half as large as the one before.
    pub(super) fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Edge coordinates of the first level for those of the given image: factors along x and y.
    pub(super) fn scale(&self) -> [f64; 2] {
        let first = &self.levels[0];
        [
            first.width as f64 / self.width,
            first.height as f64 / self.height,
        ]
    }

    /// Mean squared gradient around a point of the given image in edge coordinates.
    pub(super) fn texture_at(&self, x: f64, y: f64) -> f32 {
        let cell =
            |value: f64, length: f64| ((value / length * CELLS as f64) as usize).min(CELLS - 1);
        self.texture[cell(y, self.height) * CELLS + cell(x, self.width)]
    }
}

/// Mean squared gradient of each cell.
fn texture(level: &Level) -> Vec<f32> {
    let mut sums = vec![0.0f32; CELLS * CELLS];
    let mut counts = vec![0.0f32; CELLS * CELLS];
    let (width, height) = (level.width, level.height);
    let value = |x: usize, y: usize| f32::from(level.pixels[y * width + x]);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let horizontal = value(x + 1, y) - value(x - 1, y);
            let vertical = value(x, y + 1) - value(x, y - 1);
            let cell = (y * CELLS / height) * CELLS + x * CELLS / width;
            sums[cell] += horizontal * horizontal + vertical * vertical;
            counts[cell] += 1.0;
        }
    }
    sums.iter()
        .zip(&counts)
        .map(|(sum, count)| sum / count.max(1.0))
        .collect()
}
