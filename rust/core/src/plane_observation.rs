//! The plane that depth shows of a face, and how far a pose is from it.
//!
//! A plane n·p = d in the camera frame has the inverse depth q·m at the ray m = (x, y, 1), with
//! q = n / d. That is linear in q, so all depth pixels of a face sum up exactly in a measured q and
//! its 3×3 information matrix, and refinement costs the same for ten depth pixels or ten thousand.

use nalgebra::{Isometry3, Matrix3, SMatrix, Vector3};

use crate::pose_state::{PARAMETERS, PoseState};
use crate::rigid::skew;

/// The plane that the depth pixels of one face show.
#[derive(Debug, Clone)]
pub struct PlaneObservation {
    /// Outward unit normal of the face in the object's frame.
    pub normal: Vector3<f64>,
    /// A point of the face in the object's frame [m].
    pub point: Vector3<f64>,
    /// Measured q [1/m]: inverse depth is q·(x, y, 1) on the normalised plane.
    pub inverse_plane: Vector3<f64>,
    /// Information (inverse covariance) of `inverse_plane` [m²].
    pub information: Matrix3<f64>,
    /// How many depth pixels agree with it.
    pub pixels: usize,
}

impl PlaneObservation {
    /// Squared Mahalanobis distance from a state, three degrees of freedom; infinite where the
    /// state puts the camera into the plane.
    pub fn squared_distance(&self, state: &PoseState) -> f64 {
        let error = self.error(state);
        if !error.iter().all(|value| value.is_finite()) {
            return f64::INFINITY;
        }
        error.dot(&(self.information * error))
    }

    /// The q that depth would show at a state, less the measured one [1/m].
    pub fn error(&self, state: &PoseState) -> Vector3<f64> {
        let q = inverse_plane(&state.T_camera_object, &self.normal, &self.point);
        q / (1.0 + state.disagreement) - self.inverse_plane
    }

    /// Derivative of [`PlaneObservation::error`] with respect to the local step (pose,
    /// disagreement).
    pub fn jacobian(&self, state: &PoseState) -> SMatrix<f64, 3, PARAMETERS> {
        let T = &state.T_camera_object;
        let R = *T.rotation.to_rotation_matrix().matrix();
        let t_object = R.transpose() * T.translation.vector;
        let n = R * self.normal;
        let d = self.normal.dot(&(self.point + t_object));
        let scale = 1.0 / (1.0 + state.disagreement);
        // δn = R (ω × n_o), δd = n_o·ρ + (n_o × Rᵀt)·ω, δq = δn / d - n δd / d².
        let d_rho = self.normal.transpose();
        let d_omega = self.normal.cross(&t_object).transpose();
        let by_rho = -n * d_rho / (d * d);
        let by_omega = -R * skew(&self.normal) / d - n * d_omega / (d * d);
        let mut jacobian = SMatrix::<f64, 3, PARAMETERS>::zeros();
        jacobian
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(by_rho * scale));
        jacobian
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&(by_omega * scale));
        jacobian.set_column(6, &(-n / d * scale * scale));
        jacobian
    }
}

/// q of a face's plane in the camera frame at a pose [1/m].
pub fn inverse_plane(
    T_camera_object: &Isometry3<f64>,
    normal: &Vector3<f64>,
    point: &Vector3<f64>,
) -> Vector3<f64> {
    let n = T_camera_object.rotation * normal;
    let p = T_camera_object.rotation * point + T_camera_object.translation.vector;
    n / n.dot(&p)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::lm::LeastSquares;
    use crate::numeric::assert_jacobian;
    use crate::pose_problem::tests::{problem, state};
    use nalgebra::SVector;

    pub fn plane() -> PlaneObservation {
        PlaneObservation {
            normal: Vector3::new(0.1, -0.3, 1.0).normalize(),
            point: Vector3::new(0.02, 0.04, 0.05),
            inverse_plane: Vector3::new(0.1, 0.2, 1.4),
            information: Matrix3::new(5.0, 1.0, 0.5, 1.0, 4.0, -1.0, 0.5, -1.0, 9.0) * 1e4,
            pixels: 100,
        }
    }

    #[test]
    fn the_plane_jacobian_is_the_derivative() {
        let plane = plane();
        assert_jacobian(
            |step| {
                plane
                    .error(&problem().moved(&state(), &SVector::from(*step)))
                    .into()
            },
            &[0.0; PARAMETERS],
            plane.jacobian(&state()),
        );
    }

    #[test]
    fn inverse_depth_is_linear_on_the_normalised_plane() {
        let plane = plane();
        let T = state().T_camera_object;
        let q = inverse_plane(&T, &plane.normal, &plane.point);
        let tangent = plane.normal.cross(&Vector3::x());
        for shift in [-0.1, 0.0, 0.07] {
            let p = T.rotation * (plane.point + tangent * shift) + T.translation.vector;
            assert!((q.dot(&(p / p.z)) - 1.0 / p.z).abs() < 1e-12);
        }
    }
}
