//! Keypoints of the frame that is looked at.

use nalgebra::{Matrix2, Rotation2, Vector2};

/// Where a query was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QueryKeypoint {
    /// Place in the image \[px\].
    pub point: [f32; 2],
    /// Diameter of the described neighbourhood \[px\].
    pub scale: f32,
    /// Orientation \[rad\], from x towards y.
    pub angle: f32,
}

impl QueryKeypoint {
    /// From the keypoint's own coordinates to the image.
    pub fn frame(&self) -> Matrix2<f32> {
        Rotation2::new(self.angle).into_inner() * self.scale
    }

    /// Place in the image \[px\].
    pub fn place(&self) -> Vector2<f32> {
        Vector2::from(self.point)
    }
}
