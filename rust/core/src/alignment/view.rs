//! Where the reference lies in the frame, and small homographies of the frame about it.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::AlignmentReference;

/// Parameters of a homography.
pub const PARAMETERS: usize = 8;

/// A start homography and the outline of the face in the frame.
#[derive(Debug, Clone)]
pub struct View {
    /// From reference edge coordinates to undistorted pixels, scaled to positive depth.
    pub homography: Matrix3<f64>,
    /// From undistorted pixels to edge coordinates of the reference.
    pub inverse: Matrix3<f64>,
    /// Where the reference's corners lie: top-left, then clockwise.
    pub outline: [Vector2<f64>; 4],
}

impl View {
    /// `None` where no camera can see the front of the reference so.
    pub fn new(reference: &AlignmentReference, homography: &Matrix3<f64>) -> Option<Self> {
        let (w, h) = (reference.width(), reference.height());
        let corners = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]];
        let mapped = corners.map(|[x, y]| homography * Vector3::new(x, y, 1.0));
        let sign = mapped[0].z.signum();
        if !mapped
            .iter()
            .all(|p| p.iter().all(|v| v.is_finite()) && p.z * sign > 0.0)
        {
            return None;
        }
        let outline = mapped.map(|p| p.xy() / p.z);
        let turns = (0..4).all(|i| {
            let [a, b, c] = [0, 1, 2].map(|k| outline[(i + k) % 4]);
            (b - a).perp(&(c - b)) > 0.0
        });
        let scaled = homography * sign;
        let inverse = scaled.try_inverse()?;
        (turns && inverse.iter().all(|v| v.is_finite())).then_some(Self {
            homography: scaled,
            inverse,
            outline,
        })
    }

    /// Edge coordinates of the reference for a pixel, `None` beyond the horizon.
    pub fn reference_point(&self, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
        let mapped = self.inverse * pixel.push(1.0);
        (mapped.z * self.inverse_sign() > 0.0).then(|| mapped.xy() / mapped.z)
    }

    /// The derivative of [`Self::reference_point`].
    pub fn reference_jacobian(&self, pixel: Vector2<f64>) -> Matrix2<f64> {
        jacobian(&self.inverse, pixel)
    }

    /// The inverse of a matrix with positive depths may have negative ones everywhere.
    fn inverse_sign(&self) -> f64 {
        let centre = self.outline.iter().sum::<Vector2<f64>>() / 4.0;
        (self.inverse * centre.push(1.0)).z.signum()
    }
}

/// The derivative of a homography at a point.
pub fn jacobian(H: &Matrix3<f64>, point: Vector2<f64>) -> Matrix2<f64> {
    let mapped = H * point.push(1.0);
    let image = mapped.xy() / mapped.z;
    let linear = H.fixed_view::<2, 2>(0, 0);
    let last = H.fixed_view::<1, 2>(2, 0);
    (linear - image * last) / mapped.z
}

/// A homography applied to a point.
pub fn apply(H: &Matrix3<f64>, point: Vector2<f64>) -> Vector2<f64> {
    let mapped = H * point.push(1.0);
    mapped.xy() / mapped.z
}

/// Coordinates about the outline's centre in units of its half diameter, in which the eight
/// parameters of a small homography are alike in size.
#[derive(Debug, Clone, Copy)]
pub struct Centred {
    centre: Vector2<f64>,
    scale: f64,
}

impl Centred {
    /// About an outline.
    pub fn about(outline: &[Vector2<f64>; 4]) -> Self {
        let centre = outline.iter().sum::<Vector2<f64>>() / 4.0;
        let radii = outline.iter().map(|p| (p - centre).norm());
        Self {
            centre,
            scale: radii.fold(1.0, f64::max),
        }
    }

    /// Pixels of one unit.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// A pixel in these coordinates.
    pub fn point(&self, pixel: Vector2<f64>) -> Vector2<f64> {
        (pixel - self.centre) / self.scale
    }

    /// How a pixel moves by the parameters at zero, 2×8.
    pub fn jacobian(&self, pixel: Vector2<f64>) -> SMatrix<f64, 2, PARAMETERS> {
        let p = self.point(pixel);
        let (x, y) = (p.x, p.y);
        #[rustfmt::skip]
        let rows = [
            x, y, 1.0, 0.0, 0.0, 0.0, -x * x, -x * y,
            0.0, 0.0, 0.0, x, y, 1.0, -x * y, -y * y,
        ];
        SMatrix::<f64, 2, PARAMETERS>::from_row_slice(&rows) * self.scale
    }

    /// The homography of the frame with these parameters; the identity at zero.
    pub fn homography(&self, p: &SVector<f64, PARAMETERS>) -> Matrix3<f64> {
        let small = Matrix3::new(
            1.0 + p[0],
            p[1],
            p[2],
            p[3],
            1.0 + p[4],
            p[5],
            p[6],
            p[7],
            1.0,
        );
        let (s, c) = (self.scale, self.centre);
        let to = Matrix3::new(
            1.0 / s,
            0.0,
            -c.x / s,
            0.0,
            1.0 / s,
            -c.y / s,
            0.0,
            0.0,
            1.0,
        );
        let back = Matrix3::new(s, 0.0, c.x, 0.0, s, c.y, 0.0, 0.0, 1.0);
        back * small * to
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::GrayImage;
    use crate::numeric::assert_jacobian;

    const OUTLINE: [Vector2<f64>; 4] = [
        Vector2::new(100.0, 80.0),
        Vector2::new(300.0, 90.0),
        Vector2::new(280.0, 260.0),
        Vector2::new(120.0, 240.0),
    ];

    #[test]
    fn the_jacobian_by_the_parameters_is_the_derivative() {
        let centred = Centred::about(&OUTLINE);
        let pixel = Vector2::new(170.0, 110.0);
        let moved = |p: &[f64; 8]| apply(&centred.homography(&SVector::from(*p)), pixel).into();
        assert_jacobian(moved, &[0.0; 8], centred.jacobian(pixel));
    }

    #[test]
    fn the_jacobian_by_the_point_is_the_derivative() {
        let H = Matrix3::new(0.9, 0.1, 5.0, -0.2, 1.1, 3.0, 1e-3, -2e-3, 1.0);
        let at = [40.0, 30.0];
        let mapped = |p: &[f64; 2]| apply(&H, Vector2::from(*p)).into();
        assert_jacobian(mapped, &at, jacobian(&H, Vector2::from(at)));
    }

    #[test]
    fn impossible_views_are_refused() {
        let pixels = vec![0; 400];
        let reference = AlignmentReference::new(GrayImage::new(20, 20, &pixels).unwrap()).unwrap();
        let view = |H: Matrix3<f64>| View::new(&reference, &H);
        assert!(view(Matrix3::identity()).is_some());
        assert!(view(-Matrix3::identity()).is_some());
        let mirrored = Matrix3::new(-1.0, 0.0, 20.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        let crossing = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -0.1, 0.0, 1.0);
        let flat = Matrix3::new(1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        let unknown = Matrix3::from_element(f64::NAN);
        for H in [mirrored, crossing, flat, unknown, Matrix3::zeros()] {
            assert!(view(H).is_none(), "{H}");
        }
    }
}
