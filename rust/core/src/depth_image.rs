//! A borrowed depth image.

use crate::camera::Camera;
use crate::error::InputError;

/// Depth [m] along the optical axis, row by row; what is not finite or not positive is missing.
#[derive(Debug, Clone, Copy)]
pub struct DepthImage<'a> {
    width: usize,
    height: usize,
    values: &'a [f32],
}

impl<'a> DepthImage<'a> {
    /// Wraps `height` rows of `width` values; the size must be the camera's.
    pub fn new(
        (width, height): (usize, usize),
        values: &'a [f32],
        camera: &Camera,
    ) -> Result<Self, InputError> {
        let fits = (width, height) == (camera.width, camera.height)
            && width.checked_mul(height) == Some(values.len());
        if !fits {
            return Err(InputError::DepthSize {
                width,
                height,
                values: values.len(),
                expected_width: camera.width,
                expected_height: camera.height,
            });
        }
        Ok(Self {
            width,
            height,
            values,
        })
    }

    /// Image width [px].
    pub fn width(&self) -> usize {
        self.width
    }

    /// Image height [px].
    pub fn height(&self) -> usize {
        self.height
    }

    /// Depth [m] at a pixel; `None` outside of the image or without a measurement.
    pub fn at(&self, u: usize, v: usize) -> Option<f64> {
        if u >= self.width || v >= self.height {
            return None;
        }
        let depth = *self.values.get(v * self.width + u)?;
        (depth.is_finite() && depth > 0.0).then(|| f64::from(depth))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn only_positive_finite_depth_counts() {
        let camera = Camera::new((3, 2), (1.0, 1.0), (1.0, 1.0), [0.0; 5]).unwrap();
        let values = [0.0, 1.5, f32::NAN, f32::INFINITY, -1.0, 2.0];
        let depth = DepthImage::new((3, 2), &values, &camera).unwrap();
        assert_eq!(depth.at(1, 0), Some(1.5));
        assert_eq!(depth.at(2, 1), Some(2.0));
        for (u, v) in [(0, 0), (2, 0), (0, 1), (1, 1), (3, 0), (0, 2)] {
            assert_eq!(depth.at(u, v), None);
        }
    }

    #[test]
    fn another_size_than_the_camera_s_is_refused() {
        let camera = Camera::new((3, 2), (1.0, 1.0), (1.0, 1.0), [0.0; 5]).unwrap();
        let error = DepthImage::new((2, 3), &[1.0; 6], &camera).unwrap_err();
        assert!(
            error.to_string().starts_with("depth must be 3×2"),
            "{error}"
        );
        assert!(DepthImage::new((3, 2), &[1.0; 5], &camera).is_err());
    }
}
