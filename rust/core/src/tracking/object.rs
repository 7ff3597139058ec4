//! What is kept of an object to follow it.

use nalgebra::{Isometry3, Matrix3};

use crate::alignment::AlignmentReference;
use crate::homography::Rigidity;
use crate::{Camera, GrayImage, InputError};

/// One face of an object.
#[derive(Debug, Clone)]
pub struct TrackedFace {
    /// Its grey values.
    pub alignment: AlignmentReference,
    /// From edge coordinates of the reference to metres on the face.
    pub face_from_edge: Matrix3<f64>,
    /// Pose of the face in its object's frame.
    pub T_object_face: Isometry3<f64>,
    /// Width and height [m].
    pub size: (f64, f64),
}

impl TrackedFace {
    /// A face.
    ///
    /// # Errors
    /// [`InputError::OutOfRange`] where a side of the image is shorter than 8 px,
    /// [`InputError::NotFinite`] or [`InputError::NotInvertible`] where `face_from_edge` is.
    pub fn new(
        image: GrayImage<'_>,
        face_from_edge: Matrix3<f64>,
        T_object_face: Isometry3<f64>,
        size: (f64, f64),
    ) -> Result<Self, InputError> {
        let what = "face_from_edge";
        if !face_from_edge.iter().all(|v| v.is_finite()) {
            return Err(InputError::NotFinite { what });
        }
        if face_from_edge.try_inverse().is_none() {
            return Err(InputError::NotInvertible { what });
        }
        Ok(Self {
            alignment: AlignmentReference::new(image)?,
            face_from_edge,
            T_object_face,
            size,
        })
    }

    /// Cosine of the angle between the face's normal and the line of sight to its centre: 1 seen
    /// straight on, negative from behind.
    pub fn cosine(&self, T_camera_object: &Isometry3<f64>) -> f64 {
        let T = T_camera_object * self.T_object_face;
        let centre = T.translation.vector;
        let normal = T.rotation * nalgebra::Vector3::z();
        -normal.dot(&centre) / centre.norm().max(f64::MIN_POSITIVE)
    }

    /// Where a pose puts the face: from edge coordinates of the reference to undistorted pixels.
    pub fn homography(&self, T_camera_object: &Isometry3<f64>, camera: &Camera) -> Matrix3<f64> {
        let T = T_camera_object * self.T_object_face;
        let R = T.rotation.to_rotation_matrix();
        let mut plane = *R.matrix();
        plane.set_column(2, &T.translation.vector);
        camera.matrix() * plane * self.face_from_edge
    }

    /// By which factor a homography departs from a rigid view of the face.
    pub fn stretch(&self, H: &Matrix3<f64>, camera: &Camera) -> f64 {
        Rigidity::new(camera.inverse_matrix(), &self.face_from_edge)
            .map_or(f64::INFINITY, |rigidity| rigidity.stretch(H))
    }
}

/// An object: its faces.
#[derive(Debug, Clone)]
pub struct TrackedObject {
    /// At least one.
    pub faces: Vec<TrackedFace>,
}
