//! What was seen of one face: its correspondences and its homography.

use nalgebra::{Isometry3, Matrix2, Matrix3, Point3, Vector2, Vector3};

use crate::error::{InputError, PoseError};

/// A point on the face and where the camera saw it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correspondence {
    /// On the face [m], x right, y up, origin at its centre.
    pub face: Vector2<f64>,
    /// Undistorted pixel.
    pub image: Vector2<f64>,
}

impl Correspondence {
    /// Pairs two lists of the same length.
    pub fn pair(face: &[Vector2<f64>], image: &[Vector2<f64>]) -> Result<Vec<Self>, InputError> {
        if face.len() != image.len() {
            return Err(InputError::PointCount {
                face: face.len(),
                image: image.len(),
            });
        }
        let pairs = face.iter().zip(image);
        Ok(pairs.map(|(&face, &image)| Self { face, image }).collect())
    }
}

/// The evidence for one face in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Pose of the face in its object's frame.
    pub T_object_face: Isometry3<f64>,
    /// Width of the face [m].
    pub width: f64,
    /// Height of the face [m].
    pub height: f64,
    /// Inlier correspondences.
    pub points: Vec<Correspondence>,
    /// From face points [m] to undistorted pixels, scaled so that the face's centre maps to a
    /// positive third coordinate.
    homography: Matrix3<f64>,
}

impl Face {
    /// Checks that sizes are positive and everything is finite, and that the homography shows
    /// the whole face, in front of the camera, from its front.
    pub fn new(
        T_object_face: Isometry3<f64>,
        (width, height): (f64, f64),
        points: Vec<Correspondence>,
        homography: Matrix3<f64>,
    ) -> Result<Self, PoseError> {
        for (name, value) in [("face width", width), ("face height", height)] {
            if !(value.is_finite() && value > 0.0) {
                let valid = "> 0 m and finite";
                Err(InputError::OutOfRange { name, value, valid })?;
            }
        }
        let finite = |v: &Vector2<f64>| v.iter().all(|value| value.is_finite());
        if !points
            .iter()
            .all(|point| finite(&point.face) && finite(&point.image))
        {
            Err(InputError::NotFinite {
                what: "face points and image points",
            })?;
        }
        if !homography.iter().all(|value| value.is_finite()) {
            Err(InputError::NotFinite { what: "homography" })?;
        }
        let homography = homography * homography[(2, 2)].signum();
        let face = Self {
            T_object_face,
            width,
            height,
            points,
            homography,
        };
        face.check_homography()?;
        Ok(face)
    }

    /// Undistorted pixel of a point on the face [m] according to the homography.
    pub fn to_image(&self, point: Vector2<f64>) -> Vector2<f64> {
        let mapped = self.homography * point.push(1.0);
        mapped.xy() / mapped.z
    }

    /// The homography of points given relative to `origin` (a point on the face), and its value
    /// and derivative there: its decomposition to first order.
    pub fn homography_at(&self, origin: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let mapped = self.homography * origin.push(1.0);
        let value = mapped.xy() / mapped.z;
        let slope = self.homography.fixed_view::<2, 2>(0, 0)
            - value * self.homography.fixed_view::<1, 2>(2, 0);
        (value, slope / mapped.z)
    }

    /// The corners [m] on the face: top-left, top-right, bottom-right, bottom-left.
    pub fn corners(&self) -> [Vector2<f64>; 4] {
        let (x, y) = (self.width / 2.0, self.height / 2.0);
        [
            Vector2::new(-x, y),
            Vector2::new(x, y),
            Vector2::new(x, -y),
            Vector2::new(-x, -y),
        ]
    }

    /// A point on the face [m] in the object's frame.
    pub fn to_object(&self, point: Vector2<f64>) -> Vector3<f64> {
        (self.T_object_face * Point3::new(point.x, point.y, 0.0)).coords
    }

    fn check_homography(&self) -> Result<(), PoseError> {
        let depth_sign = |corner: &Vector2<f64>| (self.homography * corner.push(1.0)).z;
        let in_front = self.homography[(2, 2)] > 0.0
            && self.corners().iter().all(|corner| depth_sign(corner) > 0.0);
        if !in_front {
            return Err(PoseError::BehindCamera);
        }
        // K·[r1 r2 t]: the determinant has the sign of r3·t, negative for a face that is seen.
        let determinant = self.homography.determinant();
        if determinant < 0.0 {
            Ok(())
        } else {
            Err(PoseError::Mirrored { determinant })
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::numeric::assert_jacobian;

    fn homography() -> Matrix3<f64> {
        Matrix3::new(500.0, 30.0, 320.0, 20.0, -480.0, 240.0, 0.3, -0.2, 1.0)
    }

    fn face(homography: Matrix3<f64>) -> Result<Face, PoseError> {
        Face::new(Isometry3::identity(), (0.2, 0.1), vec![], homography)
    }

    #[test]
    fn the_scale_of_the_homography_does_not_matter() {
        let point = Vector2::new(0.05, 0.02);
        let expected = face(homography()).unwrap().to_image(point);
        assert!((face(homography() * -3.0).unwrap().to_image(point) - expected).norm() < 1e-9);
    }

    #[test]
    fn the_first_order_is_the_derivative() {
        let face = face(homography()).unwrap();
        let at = [0.03, -0.04];
        let (value, slope) = face.homography_at(at.into());
        assert!((value - face.to_image(at.into())).norm() < 1e-12);
        assert_jacobian(|p: &[f64; 2]| face.to_image((*p).into()).into(), &at, slope);
    }

    #[test]
    fn faces_that_cannot_be_seen_are_refused() {
        let mut mirrored = homography();
        mirrored.set_column(0, &(-homography().column(0)));
        assert!(matches!(face(mirrored), Err(PoseError::Mirrored { .. })));
        let mut behind = homography();
        behind[(2, 0)] = 11.0;
        assert_eq!(face(behind), Err(PoseError::BehindCamera));
        assert!(face(Matrix3::zeros()).is_err());
        let nan = PoseError::Input(InputError::NotFinite { what: "homography" });
        assert_eq!(face(homography() * f64::NAN), Err(nan));
        let flat = Face::new(Isometry3::identity(), (0.2, 0.0), vec![], homography());
        assert_eq!(
            flat.unwrap_err().to_string(),
            "face height must be > 0 m and finite, got 0"
        );
    }
}
