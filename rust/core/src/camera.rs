//! Pinhole camera with OpenCV's lens distortion (k1, k2, p1, p2, k3).

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::error::InputError;

const UNDISTORT_ITERATIONS: usize = 20;
/// Normalised coordinates; 1e-12 is below a billionth of a pixel.
const UNDISTORT_TOLERANCE: f64 = 1e-12;

/// Intrinsics of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Image width [px].
    pub width: usize,
    /// Image height [px].
    pub height: usize,
    /// Focal length along x [px].
    pub fx: f64,
    /// Focal length along y [px].
    pub fy: f64,
    /// Principal point x [px].
    pub cx: f64,
    /// Principal point y [px].
    pub cy: f64,
    /// (k1, k2, p1, p2, k3), zeros for a camera without distortion.
    pub distortion: [f64; 5],
}

impl Camera {
    /// Checks the parameters: a non-empty image, positive focal lengths, everything finite.
    pub fn new(
        (width, height): (usize, usize),
        (fx, fy): (f64, f64),
        (cx, cy): (f64, f64),
        distortion: [f64; 5],
    ) -> Result<Self, InputError> {
        let positive = |name, value: f64| {
            if value > 0.0 {
                Ok(())
            } else {
                let valid = "> 0";
                Err(InputError::OutOfRange { name, value, valid })
            }
        };
        if ![fx, fy, cx, cy]
            .iter()
            .chain(&distortion)
            .all(|value| value.is_finite())
        {
            return Err(InputError::NotFinite {
                what: "camera parameters",
            });
        }
        positive("camera width", width as f64)?;
        positive("camera height", height as f64)?;
        positive("focal length fx", fx)?;
        positive("focal length fy", fy)?;
        Ok(Self {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
            distortion,
        })
    }

    /// Whether the lens bends anything.
    pub fn is_distorted(&self) -> bool {
        self.distortion.iter().any(|&k| k != 0.0)
    }

    /// From the normalised plane to undistorted pixels, K.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }

    /// Undistorted pixel to ray on the normalised plane, K⁻¹.
    pub fn inverse_matrix(&self) -> Matrix3<f64> {
        let (fx, fy) = (1.0 / self.fx, 1.0 / self.fy);
        Matrix3::new(
            fx,
            0.0,
            -self.cx * fx,
            0.0,
            fy,
            -self.cy * fy,
            0.0,
            0.0,
            1.0,
        )
    }

    /// Point on the normalised plane to pixel; no lens on either side.
    pub fn to_pixel(&self, normalised: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(
            self.fx * normalised.x + self.cx,
            self.fy * normalised.y + self.cy,
        )
    }

    /// Pixel to point on the normalised plane; no lens on either side.
    pub fn to_normalised(&self, pixel: Vector2<f64>) -> Vector2<f64> {
        Vector2::new((pixel.x - self.cx) / self.fx, (pixel.y - self.cy) / self.fy)
    }

    /// Undistorted pixel of a point in the camera frame [m]; `None` unless it lies in front.
    pub fn project(&self, point: Vector3<f64>) -> Option<Vector2<f64>> {
        (point.z > 0.0).then(|| self.to_pixel(point.xy() / point.z))
    }

    /// Where the lens puts an undistorted pixel in the image.
    pub fn observe(&self, pixel: Vector2<f64>) -> Vector2<f64> {
        if !self.is_distorted() {
            return pixel;
        }
        self.to_pixel(self.distort(self.to_normalised(pixel)))
    }

    /// Point on the normalised plane that an observed pixel shows; `None` where the lens model
    /// folds and has no inverse.
    pub fn ray(&self, observed: Vector2<f64>) -> Option<Vector2<f64>> {
        let distorted = self.to_normalised(observed);
        if self.is_distorted() {
            self.undistort(distorted)
        } else {
            Some(distorted)
        }
    }

    /// Applies the lens on the normalised plane.
    pub fn distort(&self, p: Vector2<f64>) -> Vector2<f64> {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = p.norm_squared();
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        Vector2::new(
            p.x * radial + 2.0 * p1 * p.x * p.y + p2 * (r2 + 2.0 * p.x * p.x),
            p.y * radial + p1 * (r2 + 2.0 * p.y * p.y) + 2.0 * p2 * p.x * p.y,
        )
    }

    /// Derivative of [`Camera::distort`].
    pub fn distort_jacobian(&self, p: Vector2<f64>) -> Matrix2<f64> {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = p.norm_squared();
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let slope = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));
        let cross = slope * p.x * p.y + 2.0 * p1 * p.x + 2.0 * p2 * p.y;
        Matrix2::new(
            radial + slope * p.x * p.x + 2.0 * p1 * p.y + 6.0 * p2 * p.x,
            cross,
            cross,
            radial + slope * p.y * p.y + 6.0 * p1 * p.y + 2.0 * p2 * p.x,
        )
    }

    /// Inverse of [`Camera::distort`] by Newton's method; `None` where it does not converge to a
    /// point before the fold of the lens model.
    pub fn undistort(&self, distorted: Vector2<f64>) -> Option<Vector2<f64>> {
        let mut p = distorted;
        for _ in 0..UNDISTORT_ITERATIONS {
            let error = self.distort(p) - distorted;
            let jacobian = self.distort_jacobian(p);
            if jacobian.determinant() <= 0.0 {
                return None;
            }
            if error.amax() < UNDISTORT_TOLERANCE {
                return Some(p);
            }
            p -= jacobian.try_inverse()? * error;
        }
        None
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::numeric::assert_jacobian;

    fn lens() -> Camera {
        let distortion = [-0.28, 0.09, 1.1e-3, -0.7e-3, -0.02];
        Camera::new((640, 480), (525.0, 520.0), (319.5, 239.5), distortion).unwrap()
    }

    #[test]
    fn distortion_jacobian_is_the_derivative() {
        let camera = lens();
        for point in [[0.0, 0.0], [0.4, -0.3], [-0.5, 0.2]] {
            assert_jacobian(
                |p: &[f64; 2]| camera.distort(Vector2::from(*p)).into(),
                &point,
                camera.distort_jacobian(Vector2::from(point)),
            );
        }
    }

    #[test]
    fn undistortion_inverts_distortion_over_the_whole_image() {
        let camera = lens();
        let mut checked = 0;
        for u in (0..640).step_by(40) {
            for v in (0..480).step_by(40) {
                let observed = Vector2::new(f64::from(u), f64::from(v));
                let ray = camera.ray(observed).unwrap();
                assert!((camera.observe(camera.to_pixel(ray)) - observed).norm() < 1e-8);
                checked += 1;
            }
        }
        assert_eq!(checked, 16 * 12);
    }

    #[test]
    fn a_folding_lens_has_no_inverse_instead_of_a_wrong_one() {
        let camera = Camera {
            distortion: [-0.5, 0.0, 0.0, 0.0, 0.0],
            ..lens()
        };
        // r (1 - r²/2) never exceeds 0.544.
        assert_eq!(camera.undistort(Vector2::new(0.6, 0.0)), None);
    }

    #[test]
    fn only_points_in_front_project() {
        let camera = lens();
        assert_eq!(camera.project(Vector3::new(0.0, 0.0, 0.0)), None);
        assert_eq!(camera.project(Vector3::new(0.0, 0.0, -1.0)), None);
        let pixel = camera.project(Vector3::new(0.1, 0.0, 1.0)).unwrap();
        assert_eq!(pixel, Vector2::new(319.5 + 52.5, 239.5));
    }

    #[test]
    fn impossible_parameters_are_refused_with_their_value() {
        let error = Camera::new((640, 480), (-1.0, 520.0), (0.0, 0.0), [0.0; 5]).unwrap_err();
        assert_eq!(error.to_string(), "focal length fx must be > 0, got -1");
        let error = Camera::new((640, 480), (f64::NAN, 1.0), (0.0, 0.0), [0.0; 5]);
        assert_eq!(
            error.unwrap_err(),
            InputError::NotFinite {
                what: "camera parameters"
            }
        );
        assert!(Camera::new((0, 480), (1.0, 1.0), (0.0, 0.0), [0.0; 5]).is_err());
    }
}
