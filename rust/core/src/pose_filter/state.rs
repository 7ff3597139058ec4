//! The state, its prediction and its correction.

use nalgebra::{
    Isometry3, Matrix6, SMatrix, SVector, Translation3, UnitQuaternion, Vector3, Vector6,
};

use super::PoseFilterConfig;
use crate::InputError;

/// Errors of a state: translation, rotation vector, linear and angular velocity.
pub const ERRORS: usize = 12;

type Covariance = SMatrix<f64, ERRORS, ERRORS>;

/// What the filter believes at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct FilteredPose {
    /// [s].
    pub time: f64,
    /// The pose in the fixed frame, for example the robot's base.
    pub T_base_object: Isometry3<f64>,
    /// Of the object's origin along the base's axes [m/s].
    pub linear_velocity: Vector3<f64>,
    /// About the base's axes [rad/s].
    pub angular_velocity: Vector3<f64>,
    /// Of the errors along the base's axes.
    pub covariance: Covariance,
}

/// A pose as measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// In the fixed frame.
    pub T_base_object: Isometry3<f64>,
    /// Of (translation, rotation vector) in the object's frame, as detections have it.
    pub covariance: Matrix6<f64>,
}

/// A measurement less what was expected.
struct Innovation {
    error: Vector6<f64>,
    /// Covariance of the measurement along the base's axes.
    R: Matrix6<f64>,
    /// Covariance of the error.
    S: Matrix6<f64>,
}

impl FilteredPose {
    /// Starts from one measurement, with velocity unknown.
    pub fn first(time: f64, measured: &Measurement, config: &PoseFilterConfig) -> Self {
        let mut covariance = Covariance::zeros();
        let pose = measured.in_base_axes() + tremor(config);
        covariance.fixed_view_mut::<6, 6>(0, 0).copy_from(&pose);
        let speeds = diagonal(config.linear_speed.powi(2), config.angular_speed.powi(2));
        covariance.fixed_view_mut::<6, 6>(6, 6).copy_from(&speeds);
        Self {
            time,
            T_base_object: measured.T_base_object,
            linear_velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
            covariance,
        }
    }

    /// Whether it can be predicted to a time.
    ///
    /// # Errors
    /// [`InputError::BackInTime`] unless that is finite and not before the state's.
    pub fn check_time(&self, time: f64) -> Result<(), InputError> {
        match time.is_finite() && time >= self.time {
            true => Ok(()),
            false => Err(InputError::BackInTime {
                state: self.time,
                time,
            }),
        }
    }

    /// The state at a time that is not before its own ([`Self::check_time`]), by constant velocity.
    pub fn predicted(&self, time: f64, config: &PoseFilterConfig) -> Self {
        let dt = time - self.time;
        let turn = UnitQuaternion::from_scaled_axis(self.angular_velocity * dt);
        let T = Isometry3::from_parts(
            Translation3::from(self.T_base_object.translation.vector + self.linear_velocity * dt),
            turn * self.T_base_object.rotation,
        );
        let mut F = Covariance::identity();
        F.fixed_view_mut::<3, 3>(3, 3)
            .copy_from(turn.to_rotation_matrix().matrix());
        F.fixed_view_mut::<6, 6>(0, 6)
            .copy_from(&(Matrix6::identity() * dt));
        // White acceleration of that power spectral density, integrated once and twice over dt.
        let density = diagonal(
            config.linear_acceleration.powi(2),
            config.angular_acceleration.powi(2),
        );
        let mut covariance = F * self.covariance * F.transpose();
        for (row, column, factor) in [
            (0, 0, dt.powi(3) / 3.0),
            (6, 6, dt),
            (0, 6, dt * dt / 2.0),
            (6, 0, dt * dt / 2.0),
        ] {
            let mut block = covariance.fixed_view_mut::<6, 6>(row, column);
            block += density * factor;
        }
        Self {
            time,
            T_base_object: T,
            covariance,
            ..self.clone()
        }
    }

    /// The state with a measurement of its own time taken in; `None` where the gate refuses it.
    pub fn corrected(&self, measured: &Measurement, config: &PoseFilterConfig) -> Option<Self> {
        let Innovation { error, R, S } = self.innovation(measured, config);
        let inverse = S.cholesky()?.inverse();
        let squared = (error.transpose() * inverse * error).x;
        if squared.is_nan() || squared > config.gate.powi(2) + 6.0 {
            return None;
        }
        let P = &self.covariance;
        let K = P.fixed_view::<ERRORS, 6>(0, 0) * inverse;
        let change = K * error;
        // Joseph's form stays symmetric and positive definite under rounding.
        let mut I_KH = Covariance::identity();
        let mut gained = I_KH.fixed_view_mut::<ERRORS, 6>(0, 0);
        gained -= K;
        let covariance = I_KH * P * I_KH.transpose() + K * R * K.transpose();
        Some(Self {
            covariance,
            ..self.moved(&change)
        })
    }

    /// Logarithm of the probability density of a measurement of its own time.
    pub fn log_likelihood(&self, measured: &Measurement, config: &PoseFilterConfig) -> f64 {
        let Innovation { error, S, .. } = self.innovation(measured, config);
        let Some(factor) = S.cholesky() else {
            return f64::NEG_INFINITY;
        };
        let whitened = factor.l().solve_lower_triangular(&error);
        let squared = whitened.map_or(f64::INFINITY, |w| w.norm_squared());
        let log_determinant = 2.0 * factor.l().diagonal().map(f64::ln).sum();
        -0.5 * (squared + log_determinant + 6.0 * std::f64::consts::TAU.ln())
    }

    /// The state with its errors changed by so much, and the covariance as it is.
    pub(super) fn moved(&self, change: &SVector<f64, ERRORS>) -> Self {
        let part = |first: usize| Vector3::from(change.fixed_rows::<3>(first));
        let mut rotation = UnitQuaternion::from_scaled_axis(part(3)) * self.T_base_object.rotation;
        rotation.renormalize();
        Self {
            T_base_object: Isometry3::from_parts(
                Translation3::from(self.T_base_object.translation.vector + part(0)),
                rotation,
            ),
            linear_velocity: self.linear_velocity + part(6),
            angular_velocity: self.angular_velocity + part(9),
            ..self.clone()
        }
    }

    /// The errors that lead from another state to this one.
    pub(super) fn difference(&self, other: &Self) -> SVector<f64, ERRORS> {
        let pose = between(&self.T_base_object, &other.T_base_object);
        let mut errors = SVector::<f64, ERRORS>::zeros();
        errors.fixed_rows_mut::<6>(0).copy_from(&pose);
        let linear = self.linear_velocity - other.linear_velocity;
        let angular = self.angular_velocity - other.angular_velocity;
        errors.fixed_rows_mut::<3>(6).copy_from(&linear);
        errors.fixed_rows_mut::<3>(9).copy_from(&angular);
        errors
    }

    fn innovation(&self, measured: &Measurement, config: &PoseFilterConfig) -> Innovation {
        let R = measured.in_base_axes() + tremor(config);
        Innovation {
            error: between(&measured.T_base_object, &self.T_base_object),
            S: self.covariance.fixed_view::<6, 6>(0, 0) + R,
            R,
        }
    }
}

impl Measurement {
    /// The covariance along the axes of the base.
    fn in_base_axes(&self) -> Matrix6<f64> {
        let R = self.T_base_object.rotation.to_rotation_matrix();
        let mut turn = Matrix6::zeros();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(R.matrix());
        turn.fixed_view_mut::<3, 3>(3, 3).copy_from(R.matrix());
        turn * self.covariance * turn.transpose()
    }
}

/// Translation and global rotation vector that lead from `b` to `a`.
fn between(a: &Isometry3<f64>, b: &Isometry3<f64>) -> Vector6<f64> {
    let translation = a.translation.vector - b.translation.vector;
    let rotation = (a.rotation * b.rotation.inverse()).scaled_axis();
    let mut error = Vector6::zeros();
    error.fixed_rows_mut::<3>(0).copy_from(&translation);
    error.fixed_rows_mut::<3>(3).copy_from(&rotation);
    error
}

fn tremor(config: &PoseFilterConfig) -> Matrix6<f64> {
    diagonal(config.tremor.powi(2), config.angular_tremor.powi(2))
}

fn diagonal(translation: f64, rotation: f64) -> Matrix6<f64> {
    let (t, r) = (translation, rotation);
    Matrix6::from_diagonal(&Vector6::new(t, t, t, r, r, r))
}
