//! From units of the taught size to metres.
//!
//! The image gives the distance in units of the taught size, depth gives it up to the depth camera's
//! bias. Their disagreement s is e + b, the error e of the taught size and the bias b of depth, of
//! which only the sum is seen. With Gaussian priors the expected share of e is κ = σ_e² / (σ_e² + σ_b²),
//! and its remaining variance κ·σ_b².

use nalgebra::{Isometry3, Matrix6, SMatrix, Vector3};

use crate::pose_state::{PARAMETERS, PoseState};

/// What is known beforehand of both scales.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScalePrior {
    /// Standard deviation of the relative error of the taught size; 0 = exact.
    pub size_sigma: f64,
    /// Standard deviation of the relative bias that all depths of a frame share; > 0.
    pub bias_sigma: f64,
}

impl ScalePrior {
    /// Standard deviation of the disagreement.
    pub fn disagreement_sigma(&self) -> f64 {
        self.size_sigma.hypot(self.bias_sigma)
    }

    /// The part of the disagreement that the taught size is to blame for.
    fn share_of_size(&self) -> f64 {
        (self.size_sigma / self.disagreement_sigma()).powi(2)
    }

    /// The pose in metres.
    pub fn metric_pose(&self, state: &PoseState) -> Isometry3<f64> {
        let mut T = state.T_camera_object;
        T.translation.vector *= 1.0 + self.share_of_size() * state.disagreement;
        T
    }

    /// Covariance of the pose in metres from that of pose and disagreement.
    pub fn metric_covariance(
        &self,
        state: &PoseState,
        covariance: &SMatrix<f64, PARAMETERS, PARAMETERS>,
    ) -> Matrix6<f64> {
        let share = self.share_of_size();
        let along = line_of_sight(state);
        let mut metric = scaled(covariance, &(along * share));
        let unknown = share * self.bias_sigma.powi(2);
        let mut block = metric.fixed_view_mut::<3, 3>(0, 0);
        block += along * along.transpose() * unknown;
        (metric + metric.transpose()) * 0.5
    }

    /// The part of it that differs from frame to frame.
    ///
    /// What both scales leave unknown is the same in all frames of a camera. Without depth that is
    /// all of the disagreement, for nothing of it was measured.
    pub fn noise_covariance(
        &self,
        state: &PoseState,
        covariance: &SMatrix<f64, PARAMETERS, PARAMETERS>,
        with_depth: bool,
    ) -> Matrix6<f64> {
        let share = if with_depth {
            self.share_of_size()
        } else {
            0.0
        };
        let noise = scaled(covariance, &(line_of_sight(state) * share));
        (noise + noise.transpose()) * 0.5
    }
}

/// A relative change of the distance moves the object along this, in the object's frame.
fn line_of_sight(state: &PoseState) -> Vector3<f64> {
    let T = &state.T_camera_object;
    T.rotation.inverse() * T.translation.vector
}

/// Covariance of a pose that moves along `direction` with the disagreement.
fn scaled(
    covariance: &SMatrix<f64, PARAMETERS, PARAMETERS>,
    direction: &Vector3<f64>,
) -> Matrix6<f64> {
    let mut jacobian = SMatrix::<f64, 6, PARAMETERS>::identity();
    jacobian.fixed_view_mut::<3, 1>(0, 6).copy_from(direction);
    jacobian * covariance * jacobian.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(disagreement: f64) -> PoseState {
        let T_camera_object = Isometry3::new(Vector3::new(0.1, 0.0, 0.7), Vector3::x() * 3.0);
        PoseState {
            T_camera_object,
            disagreement,
        }
    }

    #[test]
    fn the_less_certain_scale_takes_the_blame() {
        let distance = |size_sigma, bias_sigma| {
            let prior = ScalePrior {
                size_sigma,
                bias_sigma,
            };
            prior.metric_pose(&state(0.02)).translation.vector.z / 0.7 - 1.0
        };
        assert!(distance(0.0, 0.01).abs() < 1e-12);
        assert!((distance(0.01, 0.01) - 0.01).abs() < 1e-12);
        assert!((distance(0.01, 1e-6) - 0.02).abs() < 1e-8);
    }

    #[test]
    fn frames_share_what_remains_of_noiseless_ones() {
        let prior = ScalePrior {
            size_sigma: 0.02,
            bias_sigma: 0.01,
        };
        let zeros = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
        let mut unseen = zeros;
        unseen[(6, 6)] = prior.disagreement_sigma().powi(2);
        for (covariance, with_depth) in [(zeros, true), (unseen, false)] {
            let noise = prior.noise_covariance(&state(0.0), &covariance, with_depth);
            assert!(noise.norm() < 1e-18);
        }
        let mut measured = zeros;
        measured[(6, 6)] = 1e-6;
        let whole = prior.metric_covariance(&state(0.0), &measured);
        let shared = prior.metric_covariance(&state(0.0), &zeros);
        let noise = prior.noise_covariance(&state(0.0), &measured, true);
        assert!((whole - shared - noise).norm() < 1e-12 * whole.norm());
        assert!(noise.norm() > 1e-7);
    }

    #[test]
    fn without_depth_the_size_s_own_uncertainty_remains() {
        let prior = ScalePrior {
            size_sigma: 0.02,
            bias_sigma: 0.01,
        };
        let mut covariance = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
        covariance[(6, 6)] = prior.disagreement_sigma().powi(2);
        let metric = prior.metric_covariance(&state(0.0), &covariance);
        let variance = metric.fixed_view::<3, 3>(0, 0).trace();
        assert!((variance.sqrt() / (0.02 * 0.5f64.sqrt()) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn where_depth_tells_the_sum_the_smaller_of_both_remains_at_most() {
        let prior = ScalePrior {
            size_sigma: 0.02,
            bias_sigma: 0.01,
        };
        let covariance = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
        let metric = prior.metric_covariance(&state(0.0), &covariance);
        let relative = metric.fixed_view::<3, 3>(0, 0).trace().sqrt() / 0.5f64.sqrt();
        assert!(relative < 0.01 && relative > 0.008, "{relative}");
    }
}
