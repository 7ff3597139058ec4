//! Keypoints.

/// A place in an image with a size and a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// Column [px], pixel centres at integer coordinates.
    pub x: f32,
    /// Row [px].
    pub y: f32,
    /// Diameter of the neighbourhood that was looked at [px].
    pub scale: f32,
    /// Orientation [rad], from x towards y.
    pub angle: f32,
    /// Strength, larger is stronger.
    pub response: f32,
    /// Sign of the Laplacian: 1 where the middle is darker than what is about it, -1 where it is brighter,
    /// 0 where the extractor does not tell. Keypoints of different signs cannot look alike (Bay et al.,
    /// CVIU 2008, section 4.3): they are not compared, 0 with 0 only.
    pub sign: i8,
}
