//! A face of the library as the search needs it.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::appearance::Appearance;
use crate::InputError;

/// One face: where its descriptors lie on the reference image, and what it looks like.
#[derive(Debug, Clone)]
pub struct SearchedFace {
    size: Vector2<f64>,
    face_from_edge: Matrix3<f64>,
    points: Vec<[f32; 2]>,
    frames: Vec<[f32; 4]>,
    appearance: Appearance,
}

impl SearchedFace {
    /// A face.
    ///
    /// `size`: width and height of the reference image [px]. `face_from_edge`: from its edge
    /// coordinates to metres on the face. `points` and `frames`: of its keypoints, in the order of
    /// the index; frames are 2×2 row by row, from the keypoint's own frame to the reference.
    ///
    /// # Errors
    /// [`InputError::PointCount`] unless there is one frame a point,
    /// [`InputError::NotInvertible`] where `face_from_edge` has no inverse.
    pub fn new(
        size: Vector2<f64>,
        face_from_edge: Matrix3<f64>,
        points: Vec<[f32; 2]>,
        frames: Vec<[f32; 4]>,
        appearance: Appearance,
    ) -> Result<Self, InputError> {
        if points.len() != frames.len() {
            return Err(InputError::FrameCount {
                points: points.len(),
                frames: frames.len(),
            });
        }
        if face_from_edge.try_inverse().is_none() {
            return Err(InputError::NotInvertible {
                what: "face_from_edge",
            });
        }
        Ok(Self {
            size,
            face_from_edge,
            points,
            frames,
            appearance,
        })
    }

    /// Number of keypoints.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no keypoints to be found by.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Width and height of the reference image [px].
    pub fn size(&self) -> Vector2<f64> {
        self.size
    }

    /// From edge coordinates of the reference image to metres on the face.
    pub fn face_from_edge(&self) -> &Matrix3<f64> {
        &self.face_from_edge
    }

    /// What it looks like.
    pub fn appearance(&self) -> &Appearance {
        &self.appearance
    }

    /// Corners of the reference in edge coordinates: top-left, then clockwise.
    pub fn corners(&self) -> [Vector2<f64>; 4] {
        let (w, h) = (self.size.x, self.size.y);
        [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]].map(Vector2::from)
    }

    /// Where a keypoint lies, in edge coordinates.
    pub fn point(&self, keypoint: u32) -> Vector2<f64> {
        let [x, y] = self.points[keypoint as usize];
        Vector2::new(f64::from(x), f64::from(y))
    }

    /// From a keypoint's own frame to the reference image.
    pub fn frame(&self, keypoint: u32) -> Matrix2<f64> {
        let [a, b, c, d] = self.frames[keypoint as usize].map(f64::from);
        Matrix2::new(a, b, c, d)
    }
}
