//! The cost of a pose: reprojection of correspondences and agreement with measured planes.
//!
//! Seven parameters: the pose in units of the taught size, perturbed in the object's frame
//! (translation, rotation vector), and one nuisance with a Gaussian prior: the relative disagreement
//! s between the depth camera's scale and that of the taught size, z_measured = (1 + s)·z. Without
//! planes it touches only its prior, and this is plain PnP. Who is how far to blame for s, and so
//! what the distance in metres is, is decided afterwards (`scale`): the evidence cannot tell.

use nalgebra::{Isometry3, Matrix2x3, Matrix3, SMatrix, SVector, Vector2, Vector3, Vector6};

use crate::camera::Camera;
use crate::lm::{LeastSquares, Normal};
use crate::plane_observation::PlaneObservation;
use crate::pose_state::{PARAMETERS, PoseState};
use crate::rigid::perturbed;
use crate::robust::CauchySum;

/// A correspondence in the object's frame.
#[derive(Debug, Clone, Copy)]
pub struct ObjectPoint {
    /// In the object's frame [m].
    pub object: Vector3<f64>,
    /// Undistorted pixel.
    pub image: Vector2<f64>,
}

/// All evidence for one object with its noise.
#[derive(Debug, Clone)]
pub struct PoseProblem {
    focal: Vector2<f64>,
    centre: Vector2<f64>,
    /// Correspondences of all faces.
    pub points: Vec<ObjectPoint>,
    /// Measured planes, at most one a face.
    pub planes: Vec<PlaneObservation>,
    /// Standard deviation of an image point along one axis [px].
    pub pixel_sigma: f64,
    /// Standard deviation of the prior of the disagreement.
    pub disagreement_sigma: f64,
}

impl PoseProblem {
    /// A problem without depth.
    pub fn new(camera: &Camera, points: Vec<ObjectPoint>, pixel_sigma: f64) -> Self {
        Self {
            focal: Vector2::new(camera.fx, camera.fy),
            centre: Vector2::new(camera.cx, camera.cy),
            points,
            planes: Vec::new(),
            pixel_sigma,
            disagreement_sigma: 1.0,
        }
    }

    /// Squared reprojection error of a point [px²]; infinite behind the camera.
    pub fn squared_error(&self, T: &Isometry3<f64>, point: &ObjectPoint) -> f64 {
        let p = T.rotation * point.object + T.translation.vector;
        if p.z <= 0.0 {
            return f64::INFINITY;
        }
        (self.to_pixel(&p) - point.image).norm_squared()
    }

    /// Sum of the robust losses of all points, in units of sigma².
    pub fn reprojection_cost(&self, T: &Isometry3<f64>) -> f64 {
        let information = self.pixel_sigma.powi(-2);
        let R = T.rotation.to_rotation_matrix();
        let mut losses = CauchySum::default();
        for point in &self.points {
            let p = R * point.object + T.translation.vector;
            if p.z <= 0.0 {
                return f64::INFINITY;
            }
            losses.add((self.to_pixel(&p) - point.image).norm_squared() * information);
        }
        losses.total()
    }

    fn prior_cost(&self, state: &PoseState) -> f64 {
        (state.disagreement / self.disagreement_sigma).powi(2)
    }

    fn to_pixel(&self, p: &Vector3<f64>) -> Vector2<f64> {
        self.focal.component_mul(&(p.xy() / p.z)) + self.centre
    }

    fn add_points(&self, state: &PoseState, normal: &mut Normal<PARAMETERS>) {
        let T = &state.T_camera_object;
        let R = *T.rotation.to_rotation_matrix().matrix();
        let information = self.pixel_sigma.powi(-2);
        let mut losses = CauchySum::default();
        let mut hessian = SMatrix::<f64, 6, 6>::zeros();
        let mut gradient = SVector::<f64, 6>::zeros();
        for point in &self.points {
            let p = R * point.object + T.translation.vector;
            if p.z <= 0.0 {
                normal.cost = f64::INFINITY;
                return;
            }
            let residual = self.to_pixel(&p) - point.image;
            let weight = losses.add(residual.norm_squared() * information);
            let jacobian = self.reprojection_jacobian(&R, &point.object, &p);
            let weighted = jacobian.transpose() * (weight * information);
            hessian += weighted * jacobian;
            gradient += weighted * residual;
        }
        normal.cost += losses.total();
        let mut block = normal.hessian.fixed_view_mut::<6, 6>(0, 0);
        block += hessian;
        let mut rows = normal.gradient.fixed_rows_mut::<6>(0);
        rows += gradient;
    }

    /// Derivative of a pixel with respect to the local pose step; `p` is R·object + t.
    fn reprojection_jacobian(
        &self,
        R: &Matrix3<f64>,
        object: &Vector3<f64>,
        p: &Vector3<f64>,
    ) -> SMatrix<f64, 2, 6> {
        let (gx, gy) = (self.focal.x / p.z, self.focal.y / p.z);
        let projection = Matrix2x3::new(gx, 0.0, -gx * p.x / p.z, 0.0, gy, -gy * p.y / p.z) * R;
        let mut jacobian = SMatrix::<f64, 2, 6>::zeros();
        jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(&projection);
        // d(R·Exp(ω)·X) = R·(ω × X), and a row a of the projection gives a·(ω × X) = (X × a)·ω.
        for row in 0..2 {
            let a = projection.row(row).transpose();
            jacobian
                .fixed_view_mut::<1, 3>(row, 3)
                .copy_from(&object.cross(&a).transpose());
        }
        jacobian
    }

    fn add_planes(&self, state: &PoseState, normal: &mut Normal<PARAMETERS>) {
        for plane in &self.planes {
            normal.cost += plane.squared_distance(state);
            let error = plane.error(state);
            let jacobian = plane.jacobian(state);
            let weighted = jacobian.transpose() * plane.information;
            normal.hessian += weighted * jacobian;
            normal.gradient += weighted * error;
        }
        let information = self.disagreement_sigma.powi(-2);
        normal.cost += self.prior_cost(state);
        normal.hessian[(6, 6)] += information;
        normal.gradient[6] += information * state.disagreement;
    }
}

impl LeastSquares<PARAMETERS> for PoseProblem {
    type State = PoseState;

    fn linearize(&self, state: &PoseState) -> Normal<PARAMETERS> {
        let mut normal = Normal {
            cost: 0.0,
            gradient: SVector::zeros(),
            hessian: SMatrix::zeros(),
        };
        self.add_points(state, &mut normal);
        self.add_planes(state, &mut normal);
        normal
    }

    fn moved(&self, state: &PoseState, step: &SVector<f64, PARAMETERS>) -> PoseState {
        let delta: Vector6<f64> = step.fixed_rows::<6>(0).into_owned();
        PoseState {
            T_camera_object: perturbed(&state.T_camera_object, &delta),
            disagreement: state.disagreement + step[6],
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
pub(crate) mod tests {
    use super::*;
    use crate::numeric::assert_jacobian;

    pub fn problem() -> PoseProblem {
        let camera = Camera::new((640, 480), (525.0, 520.0), (319.5, 239.5), [0.0; 5]).unwrap();
        PoseProblem::new(&camera, Vec::new(), 0.5)
    }

    pub fn state() -> PoseState {
        let rotation = Vector3::new(2.7, 0.3, -0.4);
        let T_camera_object = Isometry3::new(Vector3::new(0.05, -0.1, 0.7), rotation);
        PoseState {
            T_camera_object,
            disagreement: 0.02,
        }
    }

    fn moved(step: &[f64; PARAMETERS]) -> PoseState {
        problem().moved(&state(), &SVector::from(*step))
    }

    #[test]
    fn the_reprojection_jacobian_is_the_derivative() {
        let problem = problem();
        let object = Vector3::new(0.08, -0.06, 0.03);
        let pixel = |step: &[f64; 6]| {
            let T = perturbed(&state().T_camera_object, &Vector6::from(*step));
            problem
                .to_pixel(&(T.rotation * object + T.translation.vector))
                .into()
        };
        let T = state().T_camera_object;
        let R = *T.rotation.to_rotation_matrix().matrix();
        let p = R * object + T.translation.vector;
        assert_jacobian(
            pixel,
            &[0.0; 6],
            problem.reprojection_jacobian(&R, &object, &p),
        );
    }

    #[test]
    fn the_gradient_is_half_the_derivative_of_the_cost() {
        let mut problem = problem();
        problem.disagreement_sigma = 0.01;
        problem
            .planes
            .push(crate::plane_observation::tests::plane());
        problem.points.push(ObjectPoint {
            object: Vector3::new(0.08, -0.06, 0.0),
            image: Vector2::new(400.0, 130.0),
        });
        let normal = problem.linearize(&state());
        let of_points = problem.reprojection_cost(&state().T_camera_object);
        let of_planes = problem.planes[0].squared_distance(&state());
        let cost = of_points + of_planes + problem.prior_cost(&state());
        assert!((normal.cost - cost).abs() <= 1e-12 * cost);
        assert_jacobian(
            |step| [problem.linearize(&moved(step)).cost / normal.gradient.amax()],
            &[0.0; PARAMETERS],
            normal.gradient.transpose() * (2.0 / normal.gradient.amax()),
        );
    }

    #[test]
    fn a_point_behind_the_camera_costs_infinitely_much() {
        let mut problem = problem();
        let object = Vector3::new(0.0, 0.0, 5.0);
        problem.points.push(ObjectPoint {
            object,
            image: Vector2::zeros(),
        });
        assert!(
            problem
                .reprojection_cost(&state().T_camera_object)
                .is_infinite()
        );
        assert!(problem.linearize(&state()).cost.is_infinite());
    }
}
