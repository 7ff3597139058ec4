//! A face of the library as the search needs it.

use nalgebra::{Matrix2, Matrix3, Vector2};

use super::appearance::Appearance;
use crate::alignment::AlignmentReference;
use crate::{GrayImage, InputError};

/// One face: where its descriptors lie on the reference image, and what it looks like.
#[derive(Debug, Clone)]
pub struct SearchedFace {
    size: Vector2<f64>,
    face_from_edge: Matrix3<f64>,
    points: Vec<[f32; 2]>,
    frames: Vec<[f32; 4]>,
    appearance: Appearance,
    alignment: Option<AlignmentReference>,
}

impl SearchedFace {
    /// A face.
    ///
    /// `face_from_edge`: from the reference image's edge coordinates to metres on the face. `points` and `frames`: of its keypoints, in the order of
    /// the index; frames are 2×2 row by row, from the keypoint's own frame to the reference.
    ///
    /// # Errors
    /// [`InputError::FrameCount`] unless there is one frame a point, [`InputError::NotFinite`]
    /// where a number is not, [`InputError::NotInvertible`] where `face_from_edge` has no inverse,
    /// [`InputError::OutOfRange`] where the image is empty.
    pub fn new(
        image: GrayImage<'_>,
        face_from_edge: Matrix3<f64>,
        points: Vec<[f32; 2]>,
        frames: Vec<[f32; 4]>,
    ) -> Result<Self, InputError> {
        if points.len() != frames.len() {
            return Err(InputError::FrameCount {
                points: points.len(),
                frames: frames.len(),
            });
        }
        let mut keypoints = points.as_flattened().iter().chain(frames.as_flattened());
        if !keypoints.all(|v| v.is_finite()) {
            return Err(InputError::NotFinite {
                what: "points and frames",
            });
        }
        if !face_from_edge.iter().all(|v| v.is_finite()) {
            return Err(InputError::NotFinite {
                what: "face_from_edge",
            });
        }
        if face_from_edge.try_inverse().is_none() {
            return Err(InputError::NotInvertible {
                what: "face_from_edge",
            });
        }
        Ok(Self {
            size: Vector2::new(image.width() as f64, image.height() as f64),
            face_from_edge,
            points,
            frames,
            appearance: Appearance::new(image)?,
            // An image that is too small to be aligned can still be found.
            alignment: AlignmentReference::new(image).ok(),
        })
    }

    /// Bytes that it occupies.
    pub fn bytes(&self) -> usize {
        let keypoints = size_of_val(&self.points[..]) + size_of_val(&self.frames[..]);
        let alignment = self.alignment.as_ref().map_or(0, AlignmentReference::bytes);
        keypoints + self.appearance.bytes() + alignment
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

    /// For the alignment of grey values; `None` where the reference image is too small.
    pub fn alignment(&self) -> Option<&AlignmentReference> {
        self.alignment.as_ref()
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

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A face of 4×2 pixels.
    fn made(
        face_from_edge: Matrix3<f64>,
        points: Vec<[f32; 2]>,
        frames: Vec<[f32; 4]>,
    ) -> Result<SearchedFace, InputError> {
        let image = GrayImage::new(4, 2, &[0; 8])?;
        SearchedFace::new(image, face_from_edge, points, frames)
    }

    #[test]
    fn keypoints_and_corners_are_those_given() {
        let frames = vec![[1.0; 4], [1.0, 2.0, 3.0, 4.0]];
        let face = made(Matrix3::identity(), vec![[0.0; 2], [3.5, 1.5]], frames).unwrap();
        assert_eq!(face.len(), 2);
        assert_eq!(face.point(1), Vector2::new(3.5, 1.5));
        assert_eq!(face.frame(1), Matrix2::new(1.0, 2.0, 3.0, 4.0));
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]].map(Vector2::from);
        assert_eq!(face.corners(), corners);
        assert!(
            made(Matrix3::identity(), vec![], vec![])
                .unwrap()
                .is_empty()
        );
    }

    #[test]
    fn what_cannot_be_a_face_is_refused() {
        let (point, frame) = (vec![[1.0; 2]], vec![[1.0; 4]]);
        let unpaired = made(Matrix3::identity(), point.clone(), vec![]);
        let expected = InputError::FrameCount {
            points: 1,
            frames: 0,
        };
        assert_eq!(unpaired.unwrap_err(), expected);
        let what = "face_from_edge";
        let flat = made(Matrix3::zeros(), point.clone(), frame.clone());
        assert_eq!(flat.unwrap_err(), InputError::NotInvertible { what });
        let lost = made(Matrix3::repeat(f64::NAN), point.clone(), frame.clone());
        assert_eq!(lost.unwrap_err(), InputError::NotFinite { what });
        let what = "points and frames";
        for (points, frames) in [
            (vec![[1.0, f32::NAN]], frame),
            (point, vec![[1.0, 0.0, f32::INFINITY, 1.0]]),
        ] {
            let found = made(Matrix3::identity(), points, frames);
            assert_eq!(found.unwrap_err(), InputError::NotFinite { what });
        }
    }
}
